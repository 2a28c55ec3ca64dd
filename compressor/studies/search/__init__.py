"""Where a metric passes a value or peaks, to within its error bars."""

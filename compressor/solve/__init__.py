"""A case -> its outcome: motion, metrics, error bars, reasons."""

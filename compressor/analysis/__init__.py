"""What runs mean, and what the paper says of them."""

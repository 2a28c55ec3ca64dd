"""What accuracy and each part of the model cost, and what they change."""

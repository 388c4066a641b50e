"""What runs in the trainer's container, and in a notebook."""

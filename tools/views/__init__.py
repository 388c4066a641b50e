"""Pictures of the shipped arena for the documentation, as MuJoCo draws them."""

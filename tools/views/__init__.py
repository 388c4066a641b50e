"""Pictures of the shipped arena for the documentation, drawn with MuJoCo."""

"""Training sets and neural networks."""

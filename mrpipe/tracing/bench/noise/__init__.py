"""The noise of a campaign, and the fit of the declared model with weights by this noise.

Hum, noise of the motion and differences of repeated motion give the weight of each sample and the noise floor. This is
the second step of a tracing. All later steps compare errors with this floor.
"""

"""Models of a run in the formats of other programs: C, JSON, ONNX and MATLAB, each with test vectors.

One file of `formats` writes one kind of model in one format, see :mod:`mrpipe.exports.contract`.
"""

"""One file for each kind of model and format; each defines `FORMAT`, see :mod:`mrpipe.exports.contract`."""

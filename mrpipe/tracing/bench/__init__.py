"""Tracing on the damper test bench: which effect is missing from a damper model, from measured minus simulated force.

The packages are the steps of a tracing in the order of the data, and each imports only the packages before it:

1. :mod:`~mrpipe.tracing.bench.campaign_tests`: faulty tests are left out; effects that the tests cannot show are listed
   with a reason.
2. :mod:`~mrpipe.tracing.bench.noise`: the declared model is fitted, with weights and a noise floor from sensors and
   repeated motion.
3. :mod:`~mrpipe.tracing.bench.residuals`: measures of a residual, which all later steps use.
4. :mod:`~mrpipe.tracing.bench.selection`: effects are added to one base form, while each explains enough.
5. :mod:`~mrpipe.tracing.bench.base_forms`: the race compares all base forms with the effects that they need.
6. :mod:`~mrpipe.tracing.bench.model_choice`: races are repeated with better weights, filter and rate.
7. :mod:`~mrpipe.tracing.bench.rivals`: effects that a rival of the chosen model makes superfluous are dropped.
8. :mod:`~mrpipe.tracing.bench.validation`: errors on the validation tests give the class of the verdict.
9. :mod:`~mrpipe.tracing.bench.verdict`: effects are named with probabilities, and the result is written as JSON.

:mod:`~mrpipe.tracing.bench.trace` runs all steps.
"""

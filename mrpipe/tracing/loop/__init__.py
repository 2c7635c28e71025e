"""The closed loop with the traced effect: corrected plant, recalibrated laws, error before and after."""

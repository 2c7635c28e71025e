"""The closed loop with the traced effect: corrected plant, recalibrated laws, errors before and after."""

"""Choice of effects for one base form, by forward selection.

Effects are screened on the residual and refitted jointly with the model. Afterwards richer forms of the effects and
further laws of the drive are tried. The race runs this search under several base forms.
"""

"""The models of other authors: NeRF², SwiftWRF, WRF-GS+ and GSRF.

The sizes, activations and relative learning rates are those of the authors' code, from which no lines are taken. The
documentation, Other authors' models, lists every setting, theirs and ours.
"""

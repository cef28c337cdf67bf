"""The chapter's control laws, one per file, as pure functions on arrays: no Drake import, no state.

Every function accepts arrays of `float` and of Drake's `AutoDiffXd` unless its docstring says
otherwise, and its docstring starts with the law's equation number. Spatial vectors are
[angular; linear]. Subscripts are the chapter's (dc: desired minus compliant), and frames are in
monogram notation. `w_CD_C` is Δᶜω_dc, the angular velocity of D relative to C expressed in C.
`dw_CD_C` is its derivative Δᶜω̇_dc, that of the components in C. `Q_CD` is {η_dc, ᶜε_dc}.
"""

"""The chapter's control laws, one per file, as pure functions on arrays: no Drake import, no state.

Every function accepts arrays of `float` and of Drake's `AutoDiffXd` unless its docstring, or that
of its module, says "floats only". The docstring of an equation's law has the equation's number:
(2.1)-(4.15) are the chapter's, those with a letter such as (L.1) are this library's.

Spatial vectors are [angular; linear]. Subscripts are the chapter's (dc: desired minus compliant),
and frames are in monogram notation. `w_CD_C` is Δᶜω_dc, the angular velocity of D relative to C
expressed in C. `dw_CD_C` is Δᶜω̇_dc, the time derivative of its components in C. `Q_CD` is
{η_dc, ᶜε_dc}. A function that "writes" fills an array of the caller, so that nothing is allocated.
"""

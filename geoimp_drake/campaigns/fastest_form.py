"""The form of controllers in many runs."""

from geoimp_drake.compilation.compiled import is_available

__all__ = ["fastest_form"]


def fastest_form() -> dict[str, str]:
    """Returns a layer of a scenario with the controller's form that runs fastest here.

    A scenario file or an override that names a form comes after it, and wins.
    """
    return {"form": "compiled" if is_available() else "blocks"}

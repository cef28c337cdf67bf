"""What users build on is what was recorded: a name, an argument or a key that goes is noticed."""

from public_names import RECORD, public_names


def test_public_names_arguments_and_keys_are_those_recorded():
    now, recorded = public_names(), RECORD.read_text(encoding="utf-8").splitlines()
    gone, new = sorted({*recorded} - {*now}), sorted({*now} - {*recorded})
    assert not gone + new, (
        f"gone: {gone}\nnew: {new}\n"
        "If that is meant, say so in CHANGELOG.md and run python tests/helpers/public_names.py. "
        "What goes is kept for one release, and warns (docs/api/index.md)."
    )

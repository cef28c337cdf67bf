"""Merges an SDF's nested models into one, to which an arm's joints and ports belong.

Drake gives every nested model an instance of its own. Here a nested model becomes a frame M of the
model around it. Its contents move there, with their poses in M. Names that are unique stay; others
get the name of their model as prefix.
"""

import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Iterator

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.description import Description
from geoimp_drake.robot_files.source import place_of

__all__ = ["flatten_models"]

_NAMED = ("link", "joint", "frame")
_SCOPE = "::"
_OWN = "__model__"
_TRUE = ("true", "1")
# Attributes, and elements whose text, name a frame, link or joint.
_REFERENCES = ("relative_to", "attached_to", "expressed_in", "joint")
_REFERRING = (
    *("parent", "child", "gearbox_reference_body", "drake:parent", "drake:child"),
    *("drake:member", "drake:bushing_frameA", "drake:bushing_frameC"),
)
_Scope = tuple[str, ...]


def flatten_models(description: Description) -> None:
    """Merges nested models into the one around them; `aliases` then has their names as in SDF.

    Raises:
        ConfigurationError: a nested model is placed by one of its frames, which is not supported.
    """
    for top in description.root.findall("model"):
        nested = [model for model in top.iter("model") if model is not top]
        if nested:
            flattener = _Flattener(top)
            flattener.flatten(top, (), _OWN)
            # Older versions cannot name the frame in which a pose is given.
            version = description.root.get("version", "")
            description.root.set("version", max(version, "1.9", key=_version))
            description.aliases |= flattener.names
            names = ", ".join(model.get("name", "") for model in nested)
            description.changes.append(f"nested models made one with that around them: {names}")


class _Flattener:
    """Takes apart the models nested in another.

    Args:
        top: that other model.

    Attributes:
        names: of links, joints, frames and models, from SDF's own with scopes to the unique ones.
    """

    def __init__(self, top: ET.Element):
        self._top = top
        scoped = [name for name, _ in _scoped(top, ())]
        simple = Counter(name[-1] for name in scoped)
        self.names: dict[str, str] = {}
        for name in scoped:
            unique = len(name) == 1 or simple[name[-1]] == 1
            self.names[_SCOPE.join(name)] = name[-1] if unique else "_".join(name)

    def flatten(self, model: ET.Element, scope: _Scope, own: str) -> None:
        """Moves a model's contents into the top, with references as seen from there.

        Args:
            model: the top or a nested one.
            scope: the models around its contents.
            own: name of its frame in the top.
        """
        for child in list(model):
            if child.tag == "model":
                self._open(child, scope, own)
                if model is self._top:
                    model.remove(child)
            elif model is self._top or child.tag in _NAMED or child.tag.startswith("drake:"):
                self._refer(child, scope, own)
                if model is not self._top:
                    self._move(child, scope, own)

    def _open(self, model: ET.Element, scope: _Scope, around: str) -> None:
        """Replaces a nested model by a frame and takes it apart."""
        if "placement_frame" in model.attrib:
            raise ConfigurationError(
                f"{place_of(model)}: model {model.get('name')!r} is placed by its frame "
                f"{model.get('placement_frame')!r}; give the pose of the model itself."
            )
        inner, own = _scope_of(model, scope), self.names[_SCOPE.join(_name_of(model, scope))]
        frame = ET.SubElement(self._top, "frame", name=own)
        links = (name for name, element in _scoped(model, inner) if element.tag == "link")
        if (first := next(links, None)) is not None:
            frame.set("attached_to", self.names[_SCOPE.join(first)])
        pose = model.find("pose")
        pose = ET.Element("pose") if pose is None else pose
        pose.set("relative_to", self._resolved(pose.get("relative_to", _OWN), scope, around))
        frame.append(pose)
        self.flatten(model, inner, own)

    def _refer(self, element: ET.Element, scope: _Scope, own: str) -> None:
        for part in element.iter():
            for key in _REFERENCES:
                if key in part.attrib:
                    part.set(key, self._resolved(part.attrib[key], scope, own))
            if part.tag in _REFERRING and part.text and not len(part):
                part.text = self._resolved(part.text.strip(), scope, own)
            for old in part.findall("use_parent_model_frame"):
                part.remove(old)
                if (old.text or "").strip() in _TRUE:
                    for xyz in part.findall("xyz"):
                        xyz.set("expressed_in", own)

    def _move(self, element: ET.Element, scope: _Scope, own: str) -> None:
        element.set("name", self._resolved(element.get("name", ""), scope, own))
        if element.tag == "link":
            pose = element.find("pose")
            pose = ET.SubElement(element, "pose") if pose is None else pose
            pose.attrib.setdefault("relative_to", own)
        if element.tag == "frame" and not element.get("attached_to"):
            element.set("attached_to", own)
        self._top.append(element)

    def _resolved(self, name: str, scope: _Scope, own: str) -> str:
        """Returns the name in the top model for a name within a scope."""
        *path, last = name.split(_SCOPE)
        if last == _OWN:
            return self.names.get(_SCOPE.join((*scope, *path)), name) if path else own
        return self.names.get(_SCOPE.join((*scope, *path, last)), name)


def _version(text: str) -> list[int]:
    return [int(number) for number in text.split(".") if number.isdigit()]


def _scoped(model: ET.Element, scope: _Scope) -> Iterator[tuple[_Scope, ET.Element]]:
    """Yields the named elements of a model and of those nested in it, with scopes."""
    for child in model:
        if child.tag in _NAMED:
            yield _name_of(child, scope), child
        elif child.tag == "model":
            yield _name_of(child, scope), child
            yield from _scoped(child, _scope_of(child, scope))


def _name_of(element: ET.Element, scope: _Scope) -> _Scope:
    return (*scope, element.get("name", ""))


def _scope_of(model: ET.Element, scope: _Scope) -> _Scope:
    """Returns the scope of a model's contents; a merged model adds none."""
    return scope if "merge" in model.attrib else _name_of(model, scope)

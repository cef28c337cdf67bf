"""The same small six-joint arm as a URDF of a ROS package, an SDF and an MJCF file."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

# Of each joint: its place in the link before, its axis, and the mass of the link that it carries.
JOINTS = [
    ([0.0, 0.0, 0.35], [0, 0, 1], 9.0),
    ([0.10, 0.03, 0.12], [0, 1, 0], 7.0),
    ([0.0, -0.04, 0.45], [0, 1, 0], 5.0),
    ([0.10, 0.0, 0.08], [1, 0, 0], 2.5),
    ([0.32, 0.0, 0.0], [0, 1, 0], 1.5),
    ([0.09, 0.0, 0.0], [1, 0, 0], 0.6),
]
EFFORTS = [310.0, 320.0, 230.0, 64.0, 55.0, 46.0]
LINKS = ["base_link", *(f"link_{k + 1}" for k in range(6))]
PACKAGE = "small_arm"

# A tetrahedron, 1 m long as it stands.
CORNERS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def stl() -> str:
    """Returns the tetrahedron as an STL file."""
    facets = ""
    for face in FACES:
        corners = "".join("vertex {} {} {}\n".format(*CORNERS[i]) for i in face)
        facets += f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n"
    return f"solid t\n{facets}endsolid t\n"


def dae(metres: float = 0.001) -> str:
    """Returns the tetrahedron as a COLLADA file in a unit of so many metres."""
    numbers = " ".join(str(x) for corner in CORNERS for x in corner)
    indices = " ".join(str(i) for face in FACES for i in face)
    return f"""<?xml version="1.0"?>
        <COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
        <asset><unit name="u" meter="{metres}"/><up_axis>Z_UP</up_axis></asset>
        <library_geometries><geometry id="g"><mesh><source id="p">
        <float_array id="a" count="12">{numbers}</float_array><technique_common>
        <accessor source="#a" count="4" stride="3"><param name="X" type="float"/>
        <param name="Y" type="float"/><param name="Z" type="float"/></accessor>
        </technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>
        </vertices><triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/>
        <p>{indices}</p></triangles></mesh></geometry></library_geometries><library_visual_scenes>
        <visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene>
        </library_visual_scenes><scene><instance_visual_scene url="#s"/></scene></COLLADA>"""


def painted_dae(colours: tuple[str, str]) -> str:
    """Returns the tetrahedron as COLLADA whose faces have two materials, two faces each."""
    text = dae()
    head, _, tail = text.partition('<triangles count="4">')
    body, _, tail = tail.partition("</triangles>")
    source, _, indices = body.partition("<p>")
    numbers = indices.removesuffix("</p>").split()
    faces = "".join(
        f'<triangles count="2" material="s{k}">{source}<p>{" ".join(part)}</p></triangles>'
        for k, part in enumerate((numbers[:6], numbers[6:]))
    )
    effects = "".join(
        f"""<effect id="e{k}"><profile_COMMON><technique sid="c"><lambert><diffuse>
        <color>{colour} 1</color></diffuse></lambert></technique></profile_COMMON></effect>"""
        for k, colour in enumerate(colours)
    )
    materials, binds = "", ""
    for k in range(2):
        materials += f'<material id="m{k}"><instance_effect url="#e{k}"/></material>'
        binds += f'<instance_material symbol="s{k}" target="#m{k}"/>'
    libraries = f"""<library_effects>{effects}</library_effects><library_materials>{materials}
        </library_materials><library_geometries>"""
    text = (head + faces + tail).replace("<library_geometries>", libraries, 1)
    bound = f"""<instance_geometry url="#g"><bind_material><technique_common>{binds}
        </technique_common></bind_material></instance_geometry>"""
    return text.replace('<instance_geometry url="#g"/>', bound)


@dataclass
class RosArm:
    """A ROS-style URDF: no transmissions, meshes of a package, a chain of fixed joints to `tool0`.

    Attributes:
        joints: how many.
        gripper: whether two fingers hang on the flange, one the mimic of the other.
        limits: text of every <limit>, one a joint; by default with the efforts of the table.
        inertial: text of <inertial> by link, instead of the table's.
        mesh: of every link; `{kind}` is visual or collision.
        tool: whether there are flange and tool0.
        extra: further elements.
    """

    joints: int = 6
    gripper: bool = False
    limits: dict[int, str] = field(default_factory=dict)
    inertial: dict[str, str] = field(default_factory=dict)
    visual: str = f'<mesh filename="package://{PACKAGE}/meshes/shell.dae"/>'
    collision: str = f'<mesh filename="package://{PACKAGE}/meshes/shell.STL" scale="0.1 0.1 0.1"/>'
    tool: bool = True
    extra: str = ""

    def urdf(self) -> str:
        text = self._link("base_link", 10.0)
        for k, (xyz, axis, mass) in enumerate(JOINTS[: self.joints]):
            limit = self.limits.get(
                k + 1, f'<limit effort="{EFFORTS[k]}" lower="-2.9" upper="2.9" velocity="3"/>'
            )
            text += self._link(LINKS[k + 1], mass)
            text += _joint(f"joint_{k + 1}", "revolute", LINKS[k], LINKS[k + 1], xyz, axis, limit)
        if self.tool:
            text += self._link("flange", 0.3, shapes=False) + '<link name="tool0"/>'
            text += _joint("to_flange", "fixed", LINKS[self.joints], "flange", [0.05, 0, 0])
            text += _joint("to_tool0", "fixed", "flange", "tool0", [0.02, 0, 0])
        return f'<robot name="small_arm">{text}{self._fingers()}{self.extra}</robot>'

    def _fingers(self) -> str:
        if not self.gripper:
            return ""
        limit = '<limit effort="20" lower="0.01" upper="0.04" velocity="1"/>'
        mimic = '<mimic joint="finger_joint" multiplier="-1"/>'
        text = ""
        for side, joint, more in ((1, "finger_joint", ""), (-1, "finger_joint_mimic", mimic)):
            link = f"finger{side}"
            text += self._link(link, 0.05, shapes=False)
            text += _joint(
                joint, "prismatic", "flange", link, [0.05, 0, 0], [0, side, 0], limit + more
            )
        return text

    def _link(self, name: str, mass: float, *, shapes: bool = True) -> str:
        inertial = self.inertial.get(name, inertial_urdf(mass))
        if shapes:
            inertial += f"<visual><geometry>{self.visual}</geometry></visual>"
            inertial += f"<collision><geometry>{self.collision}</geometry></collision>"
        return f'<link name="{name}">{inertial}</link>'

    def write(self, folder: Path) -> Path:
        """Writes the package below a folder and returns the path of the URDF."""
        package = folder / "src" / "checked_out_elsewhere"
        (package / "meshes").mkdir(parents=True)
        (package / "urdf").mkdir()
        (package / "package.xml").write_text(f"<package><name>{PACKAGE}</name></package>")
        (package / "meshes" / "shell.dae").write_text(dae())
        (package / "meshes" / "shell.STL").write_text(stl())
        (package / "urdf" / "arm.urdf").write_text(self.urdf())
        return package / "urdf" / "arm.urdf"


def moments(mass: float) -> np.ndarray:
    return mass * np.array([0.004, 0.005, 0.003])


def inertial_urdf(mass: float, xx=None, yy=None, zz=None) -> str:
    defaults = moments(mass)
    values = [d if v is None else v for v, d in zip((xx, yy, zz), defaults, strict=True)]
    xx, yy, zz = values
    return f"""<inertial><origin xyz="0.03 0.01 0.02"/><mass value="{mass}"/>
        <inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>"""


def _joint(name, kind, parent, child, xyz, axis=(0, 0, 1), more="") -> str:
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
        <origin xyz="{_text(xyz)}"/><axis xyz="{_text(axis)}"/>{more}</joint>"""


def _text(numbers) -> str:
    return " ".join(map(str, numbers))


def write_sdf(folder: Path) -> Path:
    """Writes the arm as an SDF: efforts for four joints, a mesh beside it, a frame `tcp`."""
    (folder / "shell.stl").write_text(stl())
    text = _sdf_link("base_link", 10.0, "")
    for k, (xyz, axis, mass) in enumerate(JOINTS):
        pose = f'<pose relative_to="{LINKS[k]}">{_text(xyz)} 0 0 0</pose>'
        effort = f"<effort>{EFFORTS[k]}</effort>" if k in (0, 1, 2, 5) else ""
        text += _sdf_link(LINKS[k + 1], mass, pose)
        text += f"""<joint name="joint_{k + 1}" type="revolute"><parent>{LINKS[k]}</parent>
            <child>{LINKS[k + 1]}</child><axis><xyz>{_text(axis)}</xyz><limit><lower>-2.9</lower>
            <upper>2.9</upper>{effort}</limit></axis></joint>"""
    text += '<frame name="tcp" attached_to="link_6"><pose>0.07 0 0 0 0 0</pose></frame>'
    file = folder / "arm.sdf"
    file.write_text(f'<sdf version="1.9"><model name="small_arm">{text}</model></sdf>')
    return file


def _sdf_link(name: str, mass: float, pose: str) -> str:
    xx, yy, zz = moments(mass)
    return f"""<link name="{name}">{pose}<inertial><pose>0.03 0.01 0.02 0 0 0</pose>
        <mass>{mass}</mass><inertia><ixx>{xx}</ixx><iyy>{yy}</iyy><izz>{zz}</izz></inertia>
        </inertial><collision name="c"><geometry><mesh><uri>shell.stl</uri><scale>0.1 0.1 0.1
        </scale></mesh></geometry></collision></link>"""


def write_mjcf(folder: Path) -> Path:
    """Writes the arm as an MJCF: motors, a servo, an include, a site and a coupled finger."""
    (folder / "assets").mkdir()
    (folder / "assets" / "shell.stl").write_text(stl())
    body = '<site name="tcp" pos="0.07 0 0" quat="0.70710678 0 0.70710678 0"/>'
    for side in (1, -1):
        body += f"""<body name="finger{side}" pos="0.05 0 0"><inertial pos="0 0 0" mass="0.05"
            diaginertia="1e-5 1e-5 1e-5"/><joint name="slide{side}" type="slide"
            axis="0 {side} 0"/></body>"""
    for k in reversed(range(6)):
        xyz, axis, mass = JOINTS[k]
        body = f"""<body name="{LINKS[k + 1]}" pos="{_text(xyz)}">{_mjcf_inertial(mass)}
            <joint name="joint_{k + 1}" axis="{_text(axis)}" range="-2.9 2.9"/>
            <geom type="mesh" mesh="shell" contype="0" conaffinity="0"/>{body}</body>"""
    motors = "".join(
        f'<motor name="motor_{k + 1}" joint="joint_{k + 1}" ctrlrange="-{effort} {effort}"/>'
        for k, effort in enumerate(EFFORTS[:3])
    )
    (folder / "motors.xml").write_text(f"<mujoco>{motors}</mujoco>")
    file = folder / "arm.xml"
    file.write_text(f"""<mujoco model="small_arm"><compiler angle="radian" meshdir="assets"/>
        <asset><mesh file="shell.stl" scale="0.1 0.1 0.1"/></asset>
        <worldbody><body name="base_link">{_mjcf_inertial(10.0)}{body}</body></worldbody>
        <equality><joint joint1="slide1" joint2="slide-1"/></equality>
        <actuator><include file="motors.xml"/>
        <position joint="joint_4" kp="500" forcerange="-64 64"/></actuator></mujoco>""")
    return file


def _mjcf_inertial(mass: float) -> str:
    return f'<inertial pos="0.03 0.01 0.02" mass="{mass}" diaginertia="{_text(moments(mass))}"/>'


SIDES = {"left": 0.3, "right": -0.3}  # [m] of both arms of the robots below along y


def write_dual_urdf(folder: Path) -> Path:
    """Writes two of the arms on a torso that turns, as a URDF; the left one has a finger."""
    text = _plain_link("base_link", 10.0) + _plain_link("torso", 20.0)
    limit = '<limit effort="90" lower="-1" upper="1" velocity="1"/>'
    text += _joint("torso_yaw", "revolute", "base_link", "torso", [0, 0, 0.6], [0, 0, 1], limit)
    for side, y in SIDES.items():
        parent = "torso"
        for k, (xyz, axis, mass) in enumerate(JOINTS, 1):
            place = np.add(xyz, [0, y, 0]) if k == 1 else xyz
            limit = f'<limit effort="{EFFORTS[k - 1]}" lower="-2.9" upper="2.9" velocity="3"/>'
            name, link = f"{side}_joint_{k}", f"{side}_link_{k}"
            text += _plain_link(link, mass)
            text += _joint(name, "revolute", parent, link, place, axis, limit)
            parent = link
        text += f'<link name="{side}_tool0"/>'
        text += _joint(f"{side}_to_tool0", "fixed", parent, f"{side}_tool0", [0.07, 0, 0])
    text += _plain_link("left_finger", 0.05)
    limit = '<limit effort="20" lower="0.01" upper="0.04" velocity="1"/>'
    text += _joint(
        "left_slide", "prismatic", "left_tool0", "left_finger", [0, 0, 0], [0, 1, 0], limit
    )
    file = folder / "dual.urdf"
    file.write_text(f'<robot name="dual">{text}</robot>')
    return file


def _plain_link(name: str, mass: float) -> str:
    return f'<link name="{name}">{inertial_urdf(mass)}</link>'


def write_dual_mjcf(folder: Path) -> Path:
    """Writes two of the arms, without anything welded at the wrist, on a column that lifts."""
    arms, motors = "", ""
    for side, y in SIDES.items():
        body = ""
        for k in reversed(range(6)):
            xyz, axis, mass = JOINTS[k]
            place = np.add(xyz, [0, y, 0]) if k == 0 else xyz
            name = f"{side}_joint_{k + 1}"
            body = f"""<body name="{side}_link_{k + 1}" pos="{_text(place)}">{_mjcf_inertial(mass)}
                <joint name="{name}" axis="{_text(axis)}" range="-2.9 2.9"/>{body}</body>"""
            motors += (
                f'<motor name="{name}" joint="{name}" forcerange="-{EFFORTS[k]} {EFFORTS[k]}"/>'
            )
        arms += body
    file = folder / "dual.xml"
    file.write_text(f"""<mujoco model="dual"><compiler angle="radian"/><worldbody>
        <body name="base_link">{_mjcf_inertial(10.0)}<body name="torso" pos="0 0 0.6">
        {_mjcf_inertial(20.0)}<joint name="lift" type="slide" axis="0 0 1" range="0 0.5"/>{arms}
        </body></body></worldbody><actuator>{motors}</actuator></mujoco>""")
    return file

"""What MJCF has and Drake's parser leaves out: frames, and sites turned in every way."""

import numpy as np
import pytest
from published_arms import write_mjcf
from pydrake.multibody.plant import MultibodyPlant

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.robot_files.loading import load_robot

Q = np.array([0.4, 0.3, 0.9, 0.5, -0.9, 0.3])
HALF = 0.5 * np.sqrt(2.0)
# A quarter turn about y as every one of MJCF's ways has it.
QUARTERS = {
    "quat": f"{2 * HALF} 0 {2 * HALF} 0",
    "axisangle": f"0 3 0 {np.pi / 2}",
    "euler": f"0 {np.pi / 2} 0",
    "xyaxes": "0 0 -2 0 3 0.5",
    "zaxis": "0.3 0 0",
}


def arm(file, end_effector="tcp"):
    plant = MultibodyPlant(1e-3)
    robot = load_robot(file, plant, end_effector=end_effector, geometry="leave-out")
    plant.Finalize()
    return plant, robot


def motion(file, end_effector="tcp"):
    plant, robot = arm(file, end_effector)
    model = ControlModel.of_arm(plant, robot.model_instance, robot.end_effector_frame)
    context = model.plant.CreateDefaultContext()
    model.plant.SetPositions(context, Q)
    yield model.end_effector.CalcPoseInWorld(context).GetAsMatrix4()
    yield model.plant.CalcMassMatrix(context)
    yield model.plant.CalcGravityGeneralizedForces(context)


def edited(folder, *changes):
    folder.mkdir()
    file = write_mjcf(folder)
    text = file.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    file.write_text(text)
    return file


@pytest.mark.parametrize("turn", QUARTERS)
def test_a_site_has_its_attitude_however_it_is_written(tmp_path, turn):
    old = 'quat="0.70710678 0 0.70710678 0"'
    _, robot = arm(edited(tmp_path / "a", (old, f'{turn}="{QUARTERS[turn]}"')))
    R_BS = robot.end_effector_frame.GetFixedPoseInBodyFrame().rotation().matrix()
    np.testing.assert_allclose(R_BS, [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], atol=1e-12)


def test_euler_angles_are_read_as_the_compiler_says_in_degrees_by_default(tmp_path):
    old = 'quat="0.70710678 0 0.70710678 0"'
    small, large = (
        arm(
            edited(
                tmp_path / sequence,
                (old, 'euler="20 -30 50"'),
                ('angle="radian"', f'eulerseq="{sequence}"'),
                ("-2.9 2.9", "-166 166"),
            )
        )[1]
        .end_effector_frame.GetFixedPoseInBodyFrame()
        .rotation()
        .matrix()
        for sequence in ("xyz", "XYZ")
    )
    x, y, z = np.deg2rad([20, -30, 50])
    R_x = [[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]]
    R_y = [[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]
    R_z = [[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]]
    np.testing.assert_allclose(small, np.array(R_x) @ R_y @ R_z, atol=1e-12)
    np.testing.assert_allclose(large, np.array(R_z) @ R_y @ R_x, atol=1e-12)


@pytest.mark.parametrize(
    "pose", ['pos="0.1 -0.2 0.05" euler="0.3 -0.4 1.1"', 'axisangle="1 2 3 0.7"', 'pos="0 1 0"']
)
def test_a_frame_places_bodies_and_sites_like_a_body_without_mass(tmp_path, pose):
    """Of bodies Drake knows the poses; a <frame> it would leave out with all that it holds."""
    models = []
    for tag in ("frame", "body"):
        outer = f'<{tag} name="a" {pose}><{tag} name="b" pos="0 0 0.1"><body name="link_3"'
        outer = ('<body name="link_3"', outer)
        inner = ('<site name="tcp"', f'<{tag} name="c" {pose}><site name="tcp"')
        ends = ('0"/><body name="finger1"', f'0"/></{tag}><body name="finger1"')
        file = edited(tmp_path / tag, outer, inner, ends)
        text = file.read_text()
        end = text.index("</worldbody>") - 3 * len("</body>")  # of link_3
        file.write_text(f"{text[:end]}</{tag}></{tag}>{text[end:]}")
        models.append(list(motion(file)))
    for from_frames, from_bodies in zip(*models, strict=True):
        np.testing.assert_allclose(from_frames, from_bodies, atol=1e-12)


def test_a_joint_in_a_frame_turns_about_the_axis_there(tmp_path):
    joint = 'name="joint_3" axis="0 1 0"'
    turned = f'<frame euler="0 0 {np.pi / 2}" pos="0 0 0.2"><joint {joint[:14]} axis="1 0 0"'
    file = edited(
        tmp_path / "a", (f"<joint {joint}", turned), ("<geom", "<geom"), ('2.9"/>', '2.9"/>')
    )
    text = file.read_text()
    end = text.index("/>", text.index(turned)) + 2
    file.write_text(f"{text[:end]}</frame>{text[end:]}")
    plain = edited(tmp_path / "b", (f"<joint {joint}", f'<joint {joint} pos="0 0 0.2"'))
    for one, other in zip(motion(file), motion(plain), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)
    file.write_text(file.read_text().replace(' axis="1 0 0"', ""))
    with pytest.raises(ConfigurationError, match=r"arm\.xml:\d+: joint 'joint_3' stands in a turn"):
        arm(file)

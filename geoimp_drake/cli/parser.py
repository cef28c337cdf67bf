"""Commands and options of the command line."""

import argparse
from pathlib import Path
from typing import Any, NoReturn

from geoimp_drake import __version__
from geoimp_drake.cli import (
    analysis_commands,
    bench_command,
    benchmarking,
    commands,
    identifying,
    robot_commands,
    tuning,
)
from geoimp_drake.cli.options import (
    add_duration,
    add_experiment,
    add_overrides,
    add_scenario_options,
    add_scheduler,
)
from geoimp_drake.diagrams.experiments.bench_cases import BENCH_CASES
from geoimp_drake.errors import one_line

__all__ = ["make_parser"]


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, like every other error here."""

    def error(self, message: str) -> NoReturn:
        self.exit(commands.UNUSABLE, f"geoimp: {one_line(message)} (see {self.prog} --help)\n")


def make_parser() -> argparse.ArgumentParser:
    """Returns the parser; its result for a command has the command's function as `command`."""
    parser = _Parser(
        prog="geoimp",
        description="Six-DOF impedance control in Drake: the chapter's experiments.",
    )
    parser.add_argument("--version", action="version", version=f"geoimp {__version__}")
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND", parser_class=_Parser)
    listing = subparsers.add_parser("list", help="name the experiments")
    listing.set_defaults(command=commands.list_experiments)
    init = subparsers.add_parser(
        "init",
        help="write a commented scenario of your own, to be edited",
        description="Writes a scenario: that of an experiment, or with --robot one that a robot "
        "runs at once, with a posture and gains that suit its mass. A file that is there is not "
        "touched.",
    )
    init.add_argument(
        "file", type=Path, nargs="?", metavar="FILE", help="YAML file to write (ROBOT.yaml)"
    )
    init.add_argument("--from", dest="base", metavar="EXPERIMENT", help="to begin with (plexiglas)")
    init.add_argument("--robot", type=Path, metavar="ROBOT", help="URDF, SDF or MJCF file")
    _add_robot_options(init)
    init.set_defaults(command=commands.init)
    check = subparsers.add_parser(
        "check",
        help="say what is wrong with a robot or a scenario before it runs",
        description="Builds and starts it, and prints what was changed to use the robot and what "
        "is to be warned of; writes nothing.",
        epilog="Exit status: 0, also with warnings, which are printed; 2 if it cannot be used.",
    )
    check.add_argument(
        "file", type=Path, metavar="FILE", help="a robot (URDF, SDF, MJCF), or a scenario (YAML)"
    )
    _add_robot_options(check)
    check.set_defaults(command=commands.check)
    run = subparsers.add_parser("run", help="run one experiment and write log, claims and figures")
    _add_run_options(run)
    run.set_defaults(command=commands.run)
    _add_robot_commands(subparsers)
    _add_analyze(subparsers)
    tuning.add_tune(subparsers)
    compare = subparsers.add_parser("compare", help="run several orientation families alike")
    compare.add_argument("experiment", metavar="EXPERIMENT")
    compare.add_argument(
        "--orientation", nargs="+", metavar="FAMILY", help="families (the chapter's three)"
    )
    add_scenario_options(compare)
    compare.set_defaults(command=commands.compare)
    sweep = subparsers.add_parser(
        "sweep", help="run one experiment with parameters drawn at random"
    )
    _add_sweep_options(sweep)
    sweep.set_defaults(command=commands.sweep)
    reproduce = subparsers.add_parser(
        "reproduce",
        help="run everything that the chapter shows and write one report",
        description="Runs every experiment with every variant that its figures need, and writes "
        "report.html. Started again with the same folder it does only what is missing or would "
        "come out differently.",
        epilog="Exit status: 0, also if claims fail, which the summary lists; 1 if a simulation "
        "failed; 2 if the input is unusable.",
    )
    _add_reproduce_options(reproduce)
    reproduce.set_defaults(command=commands.reproduce)
    benchmarking.add_benchmark(subparsers)
    identifying.add_identify(subparsers)
    bench = subparsers.add_parser("bench", help="time the closed loop against the bare plant")
    bench.add_argument("--json", type=Path, metavar="FILE", help="write the timings to FILE")
    bench.add_argument(
        "--only", nargs="+", metavar="CASE", help=f"of {', '.join(BENCH_CASES)} (all)"
    )
    bench.add_argument(
        "--compare", type=Path, metavar="FILE", help="show what got slower since FILE was written"
    )
    instead = bench.add_mutually_exclusive_group()
    instead.add_argument(
        "--tick", action="store_true", help="time a tick on a robot instead, beside pinocchio's"
    )
    instead.add_argument(
        "--realtime",
        action="store_true",
        help="measure instead how late commands are on LCM at 200 Hz and 1 kHz",
    )
    bench.set_defaults(command=bench_command.bench)
    return parser


def _add_analyze(subparsers: Any) -> None:
    analyze = subparsers.add_parser(
        "analyze",
        help="tell before a run on which surfaces the gains ring",
        description="Prints modes, the stiffness from which on a wall rings along each direction, "
        "and the dampings that do not ring; writes analysis.json and maps over mass, damping and "
        "wall. Nothing is simulated.",
    )
    add_experiment(analyze)
    analyze.add_argument(
        "--surface-stiffness",
        type=float,
        metavar="K",
        help="of the wall [N/m] (the scenario's surface)",
    )
    analyze.add_argument(
        "--delay", type=float, default=0.0, metavar="S", help="more of it in the wrench [s]"
    )
    add_scenario_options(analyze)
    analyze.set_defaults(command=analysis_commands.analyze)


def _add_robot_commands(subparsers: Any) -> None:
    drive = subparsers.add_parser(
        "drive",
        help="drive the robot of a scenario through its own interface",
        description="Runs a scenario with one arm on the robot that its robot.driver names, from "
        "where the robot is. Ctrl-C brakes the arm, then stops. Log, claims and figures are those "
        "of `geoimp run`; ticks.npz has every tick of the end.",
    )
    drive.add_argument("scenario", type=Path, metavar="SCENARIO", help="YAML file")
    drive.add_argument(
        "--dry-run", action="store_true", help="connect, read, compute and print; command nothing"
    )
    drive.add_argument("--no-figures", action="store_true", help="write no figures")
    drive.add_argument("--html", action="store_true", help="write replay.html, after the drive")
    _add_drive_options(drive)
    drive.set_defaults(command=robot_commands.drive)
    robot_sim = subparsers.add_parser(
        "robot-sim",
        help="simulate the robot of a scenario at the other end of LCM",
        description="The arm of a scenario speaks Drake's messages of an iiwa or a Panda, at real "
        "time, for the scenario's duration.",
    )
    robot_sim.add_argument("scenario", type=Path, metavar="SCENARIO", help="YAML file")
    robot_sim.add_argument("--lcm", default="", metavar="URL", help="of LCM (its own default)")
    robot_sim.add_argument(
        "--in-step", action="store_true", help="wait for the answer to each status"
    )
    add_overrides(robot_sim)
    add_duration(robot_sim)
    robot_sim.set_defaults(command=robot_commands.robot_sim)
    tare = subparsers.add_parser(
        "tare",
        help="find mass and centre of what hangs on the robot of a scenario",
        description="Reads the joints' external torques at rest in some postures and prints the "
        "load that explains them, beyond the robot's file, with the lines for the scenario. A real "
        "robot is moved to each posture by hand, and nothing is commanded, unless --drive lists "
        "the postures.",
    )
    tare.add_argument("scenario", type=Path, metavar="SCENARIO", help="YAML file")
    where = tare.add_mutually_exclusive_group()
    where.add_argument("--postures", type=int, default=8, metavar="N", help="how many (8)")
    where.add_argument(
        "--drive",
        type=Path,
        metavar="FILE",
        help="drive to each of the postures in a YAML file, joint positions from base to hand",
    )
    where.add_argument(
        "--log", type=Path, metavar="FILE", help="log.npz of a motion, instead of postures"
    )
    tare.add_argument(
        "--wrist", action="store_true", help="use the wrench that the robot reports, not its joints"
    )
    add_overrides(tare)
    tare.set_defaults(command=robot_commands.tare)


def _add_drive_options(parser: argparse.ArgumentParser) -> None:
    add_overrides(parser)
    add_duration(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (below results/)")


def _add_robot_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--end-effector",
        metavar="NAME",
        help="link, frame or site of the robot (its last, or one that is named like a tool)",
    )
    parser.add_argument(
        "--package",
        action="append",
        default=[],
        dest="packages",
        metavar="NAME=FOLDER",
        help="where package://NAME/ of the robot's file lies; may be given again",
    )


def _add_run_options(run: argparse.ArgumentParser) -> None:
    add_experiment(run)
    run.add_argument("--orientation", metavar="FAMILY", help="orientation family of the impedance")
    add_scenario_options(run)
    run.add_argument(
        "--simulator", metavar="NAME", help="that runs it: drake, or mujoco, an extra (drake)"
    )
    run.add_argument("--no-figures", action="store_true", help="write no figures")
    run.add_argument("--jobs", type=int, metavar="N", help="processes of worlds (one a core)")
    view = run.add_mutually_exclusive_group()
    view.add_argument("--html", action="store_true", help="write replay.html")
    view.add_argument(
        "--meshcat", action="store_true", help="show the run in a browser, at real time at most"
    )
    run.add_argument(
        "--host",
        help="address of this machine at which --meshcat listens, * for every one (127.0.0.1, "
        "which other machines do not reach); whoever reaches it can push and pause",
    )


def _add_sweep_options(sweep: argparse.ArgumentParser) -> None:
    sweep.add_argument("experiment", metavar="EXPERIMENT", help="a name that `geoimp list` shows")
    sweep.add_argument(
        "--orientation", metavar="FAMILY", help="orientation family of the impedance"
    )
    sweep.add_argument(
        "--vary",
        action="append",
        default=[],
        metavar="KEY.PATH=LOW:HIGH",
        help="draw a number of the scenario uniformly; may be repeated",
    )
    sweep.add_argument(
        "--plan", type=Path, metavar="FILE", help="YAML file with vary, samples and seed"
    )
    sweep.add_argument("--samples", type=int, metavar="N", help="how many (64)")
    sweep.add_argument("--jobs", type=int, metavar="J", help="processes (one a core)")
    add_scheduler(sweep)
    sweep.add_argument(
        "--map", nargs=2, default=(), metavar=("X", "Y"), help="varied keys of the map (first two)"
    )
    add_scenario_options(sweep)


def _add_reproduce_options(reproduce: argparse.ArgumentParser) -> None:
    reproduce.add_argument(
        "--out", type=Path, metavar="DIR", help="folder to write (results/reproduce)"
    )
    reproduce.add_argument("--jobs", type=int, metavar="N", help="processes (one a core)")
    reproduce.add_argument(
        "--duration", type=float, metavar="S", help="cut every run off after this time [s]"
    )
    reproduce.add_argument("--seed", type=int, metavar="N", help="of the sensors' noise")

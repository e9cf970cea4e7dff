"""The real logs of a folder like that of docs/real-logs.md, and the few lines that each needs beside its robot file.

Everything else is what ``collaudit init`` writes. The lines are facts of the logs' sources, never a setting.
"""

from __future__ import annotations

import csv
import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from collaudit.cli.main import run
from collaudit.core.config import LoadedConfig, load_config

#: The source's own script reads the table with dt = 0.01 s; its sensors count what acts on the arm.
LBR = "[log.csv]\nrate_hz = 100\n[log.units]\neffort_sign = { " + ", ".join(f"A{i} = -1" for i in range(1, 8)) + " }\n"
#: Motors, 5 kHz, the wrist's coupling, and where the URDF has its zero.
TX40 = """reduction = [[32, 0, 0, 0, 0, 0], [0, 32, 0, 0, 0, 0], [0, 0, 45, 0, 0, 0],
             [0, 0, 0, -48, 0, 0], [0, 0, 0, 0, 45, 0], [0, 0, 0, 0, 32, 32]]
joint_offset_rad = [0, -1.5707963, 1.5707963, 0, 0, 0]
[log.csv]
rate_hz = 5000
position = "*pos*:Joint_{i}"
effort = "*curr*:Joint_{i}"
[log.units]
effort = "Nm"
"""
#: Which of two encoders: that of the motors. The torque of a drive in N·m is named so.
KR300 = """[log.csv]
time = "time_cont"
position = "act_pos_mot_deg_{i}"
velocity = "act_vel_mot_deg_per_s_{i}"
effort = "act_torque_abs_nm_{i}"
[log.units]
position = "deg"
velocity = "deg/s"
"""
#: Currents without a constant, of which three are inverted, as `init` offers.
TIAGO = '[log.units]\neffort = "raw"\n'


@dataclass(frozen=True, slots=True)
class RealLog:
    """A log to judge, with what its robot's friction is fitted on.

    Attributes:
        name: as the tables have it.
        judged: files of the log, from the folder of data.
        fitted: files of the logs to fit; empty for the judged log itself.
        robot: a URDF, or a TOML with ``[robot]``, from the folder of data.
        stated: lines after ``[robot] urdf``, or after the TOML's.
        signs: whether the line ``effort_sign`` that `init` offers behind ``#`` is taken.
        left_out: its arm took no part in any choice of a method or number.
    """

    name: str
    judged: tuple[str, ...]
    robot: str
    fitted: tuple[str, ...] = ()
    stated: str = ""
    signs: bool = False
    left_out: bool = False

    @property
    def lines(self) -> int:
        """Keys that a user states, or uncomments, beside the robot."""
        return len(re.findall(r"^\w+ = ", self.stated, re.MULTILINE)) + self.signs

    def settings(self, data: Path, work: Path, gamma: str = "auto") -> LoadedConfig:
        """What `init` writes for the judged log, read, with thresholds of one kind; the file stays in ``work``."""
        stated, out = work / f"{self.name}.stated.toml", work / f"{self.name}.toml"
        robot = data / self.robot
        head = robot.read_text(encoding="utf-8") if robot.suffix == ".toml" else f'[robot]\nurdf = "{robot}"\n'
        stated.write_text(head + self.stated, encoding="utf-8")
        said = StringIO()
        with redirect_stdout(said), redirect_stderr(said):
            run(["init", *map(str, self.files(data, work)), "-c", str(stated), "-o", str(out), "--force"])
        if not out.exists():
            raise SystemExit(f"init of {self.name} wrote nothing:\n{said.getvalue()}")
        if self.signs:
            text = re.sub("^# effort_sign", "effort_sign", out.read_text(encoding="utf-8"), flags=re.MULTILINE)
            out.write_text(text, encoding="utf-8")
        return load_config(out, {"detect.gamma_nm": gamma})

    def files(self, data: Path, work: Path) -> tuple[Path, ...]:
        """Those of the judged log."""
        return tuple(_readable(data / file, work) for file in self.judged)

    def fitted_files(self, data: Path, work: Path) -> tuple[Path, ...]:
        """Of the log to fit."""
        return tuple(_readable(data / file, work) for file in self.fitted) or self.files(data, work)


def _readable(file: Path, work: Path) -> Path:
    """The file, or what ``rec`` of a MATLAB file holds as a table: its rows are joints, which no reader takes for that.

    The names of the columns are those that the arm's other log has.
    """
    if file.suffix != ".mat":
        return file
    from scipy.io import loadmat

    out = work / f"{file.stem}.csv"
    if not out.exists():
        record = loadmat(file, squeeze_me=True, struct_as_record=False)["rec"]
        names, columns = ["time_cont"], [record.time_cont]
        for name in ("act_pos_mot_deg", "act_vel_mot_deg_per_s", "act_torque_abs_nm"):
            names += [f"{name}_{k + 1}" for k in range(6)]
            columns += list(getattr(record, name))
        with out.open("w", newline="", encoding="utf-8") as text:
            csv.writer(text).writerows([names, *zip(*(column.tolist() for column in columns), strict=True)])
    return out


_ID = ("ur3_bags/id1.bag", "ur3_bags/id2.bag")
_FR3 = tuple(
    f"fr3_teleop/franka_follower_20260223_{name}.csv"
    for name in ("162545_final_20260223_162556", "162853_final_20260223_162903")
)
_KR300 = ("kr300/A.mat", "kr300/C_export.csv")
REAL_LOGS = (
    RealLog("UR10", ("ur10_db3/ur10_exciting_trajectory.db3",), "urdf/ur10_robot.urdf"),
    RealLog("Panda", ("panda_db3/panda_exciting_trajectory.db3",), "urdf/panda.urdf"),
    RealLog("UR3 id1", _ID[:1], "urdf/ur3_robot.urdf", signs=True),
    RealLog("UR3 id2", _ID[1:], "urdf/ur3_robot.urdf", signs=True),
    RealLog("UR3 2019", ("ur3_bags/_2019-11-27-20-59-11.bag",), "urdf/ur3_robot.urdf", signs=True),
    RealLog("UR3 id1 to id2", _ID[1:], "urdf/ur3_robot.urdf", fitted=_ID[:1], signs=True),
    RealLog("FR3 a", _FR3[:1], "urdf/fr3.urdf"),
    RealLog("FR3 b", _FR3[1:], "urdf/fr3.urdf"),
    RealLog("FR3 a to b", _FR3[1:], "urdf/fr3.urdf", fitted=_FR3[:1]),
    RealLog("FR3 b to a", _FR3[:1], "urdf/fr3.urdf", fitted=_FR3[1:]),
    RealLog("TX40", ("tx40_csv/curr_data.csv", "tx40_csv/pos_read_data.csv"), "urdf/tx40_mdh_modified.urdf",
            stated=TX40),
    RealLog("TIAGo", tuple(f"tiago_csv/tiago_{part}.csv" for part in ("effort", "position", "velocity")),
            "urdf/tiago_no_hand.urdf", stated=TIAGO,
            signs=True),
    RealLog("LBR", ("lbr_csv/measurements.csv",), "urdf/med7dock.urdf", stated=LBR, left_out=True),
    RealLog("KR300 A", _KR300[:1], "kr300/robot_dh.toml", stated=KR300, left_out=True),
    RealLog("KR300 A to C", _KR300[1:], "kr300/robot_dh.toml", fitted=_KR300[:1], stated=KR300, left_out=True),
)  # fmt: skip
#: An arm at rest that a person touches; the column that says when.
TOUCH_LOGS = tuple(
    RealLog(
        f"touch {k}", (f"franka_touch_csv/touch_0{k}.csv",), "urdf/panda.urdf", stated='[log]\nlabels = ["label"]\n'
    )
    for k in range(1, 7)
)

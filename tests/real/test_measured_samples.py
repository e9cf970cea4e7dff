"""No sample of the real logs is taken for one that was not measured, whatever their drives, encoders and clocks are."""

from __future__ import annotations

from pathlib import Path

import pytest

from collaudit.core.conditioning.conditioning import condition
from collaudit.core.config.load import parse_config
from collaudit.core.logs.log_reading import read_log

pytestmark = pytest.mark.real

RAW = '[log.units]\neffort = "raw"\n'
RATED = "[log.csv]\nrate_hz = {}\n"
LOGS = {
    **{f"ur3_bags/{name}.bag": "" for name in ("id1", "id2", "_2019-11-27-20-59-11")},
    "kuka_lwr_bag/test.bag": "",
    "ur10_db3/ur10_exciting_trajectory.db3": "",
    "panda_db3/panda_exciting_trajectory.db3": "",
    "tiago_csv/*.csv": RAW,
    "fr3_teleop/*162545*.csv": "",
    "fr3_teleop/*162853*.csv": "",
    "lbr_csv/measurements.csv": RATED.format(100),
    "tx40_csv/*.csv": RATED.format(5000) + RAW,
    **{f"franka_touch_csv/touch_0{k}.csv": "" for k in range(1, 7)},
}
CODES = {"not-measured", "log-publishers-conflict"}


@pytest.mark.parametrize("name", LOGS)
def test_every_sample_counts(name: str, data_dir: Path) -> None:
    files = tuple(sorted(data_dir.glob(name)))
    config = parse_config(LOGS[name], None).config
    series = condition(read_log(files, config.log, robot_joints=None), config.conditioning)
    assert not [finding for finding in series.findings if finding.code in CODES]

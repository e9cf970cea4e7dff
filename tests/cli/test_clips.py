"""``collaudit report --clips``: of a recording of messages its own topics, as they were recorded."""

from __future__ import annotations

from pathlib import Path

from camera_log import write_camera_log
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

NANO = 1_000_000_000


def read(path: Path) -> dict[str, list[tuple[int, bytes]]]:
    found: dict[str, list[tuple[int, bytes]]] = {}
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            found.setdefault(channel.topic, []).append((message.log_time, message.data))
    return found


def test_a_clip_holds_the_recorded_topics(arm, collaudit, tmp_path: Path) -> None:
    log, config = tmp_path / "pushed.mcap", tmp_path / "arm.toml"
    write_camera_log(log, arm.pushed, images=2)
    csv, text = arm.config.read_text().split("[log.csv]"), "[detect]"
    config.write_text(f"{csv[0]}{text}{csv[1].split(text)[1]}")
    judged = collaudit("detect", log, "-c", config, "--friction", arm.friction, "-o", tmp_path / "run")
    assert judged.code == 1, judged.err
    done = collaudit("report", tmp_path / "run", "--clips", tmp_path / "clips", "--log", log)
    assert done.code == 0 and "clips: 1 clip" in done.err, done.err
    (clip,) = (tmp_path / "clips").iterdir()
    found, whole = read(clip), read(log)
    assert "/collaudit/residual" in found and "/collaudit/joints" not in found
    first, last = found["/joint_states"][0][0], found["/joint_states"][-1][0]
    assert found["/joint_states"] == [one for one in whole["/joint_states"] if first <= one[0] <= last], "as recorded"
    assert 6.0 * NANO < last - first < 6.8 * NANO and "/camera" not in found, "no image was taken then"
    with clip.open("rb") as file:
        decoded = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(["/joint_states"])
        assert all(tuple(message.name) == ("joint1", "joint2") for *_, message in decoded)


def test_another_recording_is_refused_and_a_table_has_its_series(arm, collaudit, tmp_path: Path) -> None:
    settings = ("-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "run")
    assert collaudit("detect", arm.pushed, *settings).code == 1
    refused = collaudit("report", tmp_path / "run", "--clips", tmp_path / "clips", "--log", arm.clean)
    assert refused.code == 2 and "not the recording that was audited" in refused.err
    done = collaudit("report", tmp_path / "run", "--clips", tmp_path / "clips", "--log", arm.pushed, "--json")
    assert done.code == 0, done.err
    (clip,) = (tmp_path / "clips").iterdir()
    assert "/collaudit/joints" in read(clip)

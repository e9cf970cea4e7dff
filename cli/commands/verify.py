"""``collaudit verify``: whether an audit's folder still is what the audit wrote."""

from __future__ import annotations

from pathlib import Path

import click

from collaudit.cli.console import note, say, say_object
from collaudit.cli.group import example_command
from collaudit.core.errors import EXIT_FAIL, EXIT_NOT_JUDGED, EXIT_PASS


@example_command(
    "verify",
    "collaudit verify out/",
    "collaudit verify out/ --inputs",
    "collaudit verify out/ --key collaudit.pub",
)
@click.argument("folder", type=click.Path(path_type=Path), metavar="OUT")
@click.option("--inputs", is_flag=True, help="Compare the logs and settings that were read, too, where they are found.")
@click.option(
    "--root",
    type=click.Path(path_type=Path),
    default=Path(),
    metavar="DIR",
    help="Folder in which the audit was run, for inputs; the working folder when absent.",
)
@click.option(
    "--key", type=click.Path(path_type=Path), metavar="FILE", help="Check the signature with this public key."
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def command(folder: Path, inputs: bool, root: Path, key: Path | None, as_json: bool) -> int:
    """Compute all hashes of an audit's manifest anew, and compare.

    Exit codes: 0 everything is as it was written; 1 something was changed, removed or added, or the signature
    is not by the key; 3 nothing differs, and something could not be compared.
    """
    from collaudit.reports.files.manifest_file import (
        SIGNATURE_NAME,
        check_signature,
        compare_inputs,
        compare_outputs,
        read_manifest,
        summed,
    )

    manifest = read_manifest(folder)
    found = compare_outputs(folder, manifest)
    if inputs:
        found += compare_inputs(manifest, root)
    unsigned = None if key is None else check_signature(folder, key)
    counts = summed(found)
    differs = bool(unsigned) or any(counts[kind] for kind in ("changed", "missing", "added"))
    code = EXIT_FAIL if differs else EXIT_NOT_JUDGED if found else EXIT_PASS
    if as_json:
        answer = {"same": code == EXIT_PASS, "signature": unsigned, "counts": counts, "differences": found}
        say_object("collaudit/verify/1", answer, indent=1)
        return code
    for one in found:
        say(f"  {one.what:<8} {one.path}: {one.text}")
    if unsigned is not None:
        say(f"  signature: {unsigned}")
    compared = len(manifest.outputs) + (len(manifest.inputs) if inputs else 0)
    say(f"{'DIFFERS' if differs else 'NOT ALL COMPARED' if found else 'AS WRITTEN'}  {compared} files of {folder}")
    if not inputs:
        note("inputs were not compared; --inputs does so")
    if key is None and (folder / SIGNATURE_NAME).is_file():
        note("the signature was not checked; --key FILE does so. Without it, whoever changed a file may have changed")
        note("the manifest as well.")
    return code

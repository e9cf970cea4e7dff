"""What has to be said about an identification."""

from __future__ import annotations

from collaudit.core.data.identification_result import Identified
from collaudit.core.findings import Finding, fact


def identified_findings(identified: Identified | None) -> list[Finding]:
    """Joints that are explained worse on time left out, and physically impossible inertias."""
    if identified is None:
        return []
    findings = []
    determined = [name for name, joint in identified.joints.items() if joint.gain_by_load]
    if determined:
        others = [name for name in identified.joints if name not in determined]
        rest = f"; they do not determine those of {', '.join(others)}" if others else ""
        text = (
            f"The known loads of the logs determine the drive gains of {', '.join(determined)}, whatever the "
            f"inertials of the arm are{rest}."
        )
        findings.append(fact(text))
    for name, joint in identified.joints.items():
        if joint.gain is None:
            text = f"The motion does not show the gain of joint '{name}': its torque stays unknown and is not judged."
            findings.append(Finding("effort-sign-unknown", "warning", text, joint=name))
        if joint.gain_kept:
            text = (
                f"The motion does not determine the gain of joint '{name}' better than it is stated, so the "
                "stated gain is kept. A known load, or motion under more gravity, would determine it."
            )
            findings.append(fact(text, joint=name))
        before, after = joint.held_out_rms_file_nm, joint.held_out_rms_nm
        if before is not None and after is not None and after > 1.02 * before:
            text = (
                f"On held-out time the identified model of joint '{name}' leaves {after:.3g} N·m RMS, the robot's "
                f"description {before:.3g} N·m: the motion of this log is too little for what was to be estimated."
            )
            findings.append(Finding("identified-doubtful", "warning", text, joint=name))
    if identified.tool is not None and identified.tool.mass_halves_kg is not None:
        first, second = identified.tool.mass_halves_kg
        text = (
            f"The tool weighs {first:.3g} kg by the first half of the motion and {second:.3g} kg by the second: it was "
            "changed on the way, or something was picked up. Neither the mass in the file nor its interval holds; fit "
            "each part by itself."
        )
        findings.append(Finding("identified-doubtful", "warning", text))
    odd = [name for name, body in identified.bodies.items() if not body.consistent]
    if odd and not identified.consistent:
        text = f"No rigid body has the inertials identified for: {', '.join(odd)} ({identified.consistency})."
        findings.append(Finding("identified-doubtful", "warning", text))
    return findings

#!/usr/bin/env bash
# One night: audit, annotations, summary, exit code. Settings come as COLLAUDIT_*; nothing of them is run as code.
set -uo pipefail

logs=()
while IFS= read -r line; do
	[[ -z "${line//[[:space:]]/}" ]] || logs+=("$line")
done <<<"${COLLAUDIT_LOGS:?names of logs, one a line}"

out="${COLLAUDIT_OUT:-collaudit-out}"
arguments=(-c "${COLLAUDIT_CONFIG:-collaudit.toml}" -o "$out" -j "${COLLAUDIT_JOBS:-2}")
arguments+=(--timeout "${COLLAUDIT_TIMEOUT:-600}" --format junit,sarif,markdown,github)
[[ -z "${COLLAUDIT_FRICTION:-}" ]] || arguments+=(--friction "$COLLAUDIT_FRICTION")
[[ -z "${COLLAUDIT_BASELINE:-}" ]] || arguments+=(--baseline "$COLLAUDIT_BASELINE")
[[ -z "${COLLAUDIT_STORE:-}" ]] || arguments+=(--store "$COLLAUDIT_STORE")
[[ -z "${COLLAUDIT_ROBOT:-}" ]] || arguments+=(--robot "$COLLAUDIT_ROBOT")

collaudit audit "${arguments[@]}" -- "${logs[@]}"
code=$?

[[ ! -f "$out/summary.txt" ]] || cat "$out/summary.txt"
[[ ! -f "$out/summary.md" || -z "${GITHUB_STEP_SUMMARY:-}" ]] || cat "$out/summary.md" >>"$GITHUB_STEP_SUMMARY"
[[ -z "${COLLAUDIT_STORE:-}" ]] || collaudit trend "$COLLAUDIT_STORE" -o collaudit-trend.html
[[ -z "${GITHUB_OUTPUT:-}" ]] || echo "exit-code=$code" >>"$GITHUB_OUTPUT"

if [[ "$code" -eq 3 && "${COLLAUDIT_NOT_JUDGED:-fail}" == warn ]]; then
	echo "::warning title=Not judged::Some logs could not be judged, see $out/index.html"
	exit 0
fi
exit "$code"

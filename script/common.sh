# What the other scripts share; sourced, never run. All chatter goes to standard error.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
root=$PWD
venv=$root/.venv
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INPUT=1 PIP_RETRIES=8

say() { printf '== %s\n' "$*" >&2; }
fail() {
  printf 'error: %s\n' "$*" >&2
  exit 1
}
# Runs a command and shows what it said only if it fails.
quietly() {
  local log
  log=$(mktemp)
  if ! "$@" >"$log" 2>&1; then
    cat "$log" >&2
    rm -f "$log"
    fail "failed: $*"
  fi
  rm -f "$log"
}
# As quietly, and counts the files that are compiled meanwhile, on one line of a terminal.
compiling() {
  local log line
  log=$(mktemp)
  if ! "$@" 2>&1 | tee "$log" | while IFS= read -r line; do
    [[ $line =~ ^\ *\[([0-9]+)/([0-9]+)\] ]] || continue
    if [ -t 2 ]; then
      printf '\r   compiled %s of %s files ' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
    elif ((BASH_REMATCH[1] % 100 == 0)); then
      printf '   compiled %s of %s files\n' "${BASH_REMATCH[1]}" "${BASH_REMATCH[2]}" >&2
    fi
  done; then
    tail -n 200 "$log" >&2
    rm -f "$log"
    fail "failed: $*"
  fi
  [ ! -t 2 ] || printf '\n' >&2
  rm -f "$log"
}
jobs() { nproc; }
# Hash of the files given by git (tracked, or new and not ignored), or of all files where there is no git.
hash_of() {
  { git ls-files -co --exclude-standard -- "$@" 2>/dev/null || find "$@" -type f; } | sort -u |
    while IFS= read -r file; do [ -f "$file" ] && printf '%s\0' "$file"; done | xargs -0 sha256sum | sha256sum | cut -c1-32
}
use_venv() {
  export VIRTUAL_ENV=$venv PATH=$venv/bin:$PATH
  unset PYTHONHOME PYTHONPATH
}

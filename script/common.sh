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

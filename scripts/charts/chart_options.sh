# To be sourced from the project's folder with the caller's options, its folder in $from and a function usage: what
# scripts that run something and chart it share.   [--quick] [--charts DIR] [--json FILE] [--store]
# Sets $options (for the program), $charts, $kept (the JSON's file) and $name; makes their folders, installs what
# charts need.
name=$(basename "$0" .sh)
charts=out/$name-$(date +%Y%m%d-%H%M%S)-$$
kept=out/$name.json
store=
options=()
while (($#)); do
  case $1 in
    --charts | --json) (($# > 1)) || usage ;;&
    --charts) charts=$(cd "$from" && realpath -m "$2"); shift ;;
    --json) kept=$(cd "$from" && realpath -m "$2"); shift ;;
    --quick) options+=("$1") ;;
    --store) store=1 ;;
    *) usage ;;
  esac
  shift
done

if [[ $store && ${#options[@]} -gt 0 ]]; then
  echo "$name: --store takes the whole run; leave out --quick" >&2
  exit 2
fi
if [[ $store ]]; then charts=tests/reference/$name; fi
scripts/setup.sh --charts
mkdir -p "$charts" out "$(dirname "$kept")"

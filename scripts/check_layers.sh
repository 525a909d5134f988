#!/usr/bin/env bash
# The rules of the house that a script can check: who may include whom, and what stays in one file.
set -euo pipefail
cd "$(dirname "$0")/.."
bad=0
complain() { echo "layers: $1" >&2; bad=1; }

# forbid FOLDER OTHER…: no file of FOLDER includes a header of the others.
forbid() {
  local folder=$1; shift
  for other in "$@"; do
    while IFS= read -r hit; do complain "$folder must not include $other/: $hit"; done \
      < <(grep -rnE "#include [\"<]$other/" "$folder" --include='*.h' --include='*.cpp' || true)
  done
}
forbid core net haptics apps tests
forbid net haptics apps tests
forbid haptics net apps tests
forbid apps tests
# The rooms of the elastic rungs, one way: ladder → fem, compact → elastic → kernels.
forbid core/elastic core/fem core/compact core/ladder
forbid core/fem core/compact core/ladder
forbid core/compact core/fem core/ladder
forbid core/kernels core/elastic core/fem core/compact core/ladder
for room in kernels rbf field tissue elastic fem compact ladder; do forbid core/$room core/heterogeneous; done

# only PATTERN WHERE WHAT: the pattern occurs in no file but those matching WHERE.
only() {
  local pattern=$1 where=$2 what=$3
  while IFS= read -r file; do
    [[ $file =~ $where ]] || complain "$what belongs in one place ($where), found in $file"
  done < <(grep -rlE "$pattern" core net haptics apps --include='*.h' --include='*.cpp' || true)
}
only '#include <assimp/' '^core/mesh_io/mesh_file\.cpp$' 'assimp'
only '#include <CLI/' '^apps/command_line_parts\.h$' 'CLI11'
only '#include "apps/command_line_parts\.h"' '^apps/command_line[a-z_]*\.cpp$' 'what includes CLI11'
only '#include <toml\+\+/' '^core/scene/toml_table\.h$' 'tomlplusplus'
only '#include "core/scene/toml_table\.h"' '^core/(scene/(toml_table|scene_file|implant_keys)|plan/plan_toml)\.cpp$' 'what includes tomlplusplus'
only '#include <boost/beast' '^net/http/(http_listener\.cpp|websocket_connection\.h)$' 'Boost.Beast'
only '#include "net/http/websocket_connection\.h"' '^net/http/http_listener\.cpp$' 'what includes Boost.Beast'
only '#include <nats' '^net/broker/nats_link\.cpp$' 'libnats'
only '#include <(openssl/|boost/asio/ssl)' '^net/(tls|access)/' 'OpenSSL'
only '#include <atomic>|std::atomic' '^core/realtime/triple_buffer\.h$' 'atomics'
only 'std::j?thread[ ({]|pthread_create|std::async\(' '^apps/(brachyd/daemon\.(h|cpp)|brachy/relay\.cpp)$' 'creating threads'
only 'std::(mutex|condition_variable|shared_mutex|recursive_mutex)' '^$' 'a lock'
grep -rn 'reinterpret_cast' net && complain 'net must not cast wire bytes to structs'

# What comes from the network never becomes a file's name or content.
forbid net core/mesh_io core/scene
only '#include <(fstream|filesystem)>' '^(core|haptics|apps)/|^net/(http/served_files|access/token_file|tls/tls_context)\.(h|cpp)$' 'opening files from the network'"'"'s code'

# No stray top-level entries.
for entry in *; do
  case $entry in
    CMakeLists.txt|CMakePresets.json|LICENSE|README.md|apps|core|net|haptics|config|tests|scripts|build|out) ;;
    *) git check-ignore -q "$entry" || complain "unexpected top-level entry: $entry" ;;
  esac
done
((bad == 0)) && echo "layers: ok"
exit $bad

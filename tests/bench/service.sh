#!/usr/bin/env bash
# The server beside nginx on one machine, in one run, one thread each: a finished picture, fetched by
# its id, and the same bytes as a static file; then POST /v1/optics. Arguments: the program, a folder
# for its files. Prints requests per second and latencies as wrk measures them.
set -euo pipefail
readonly program=$1 folder=$2
readonly seconds=${FSTOP_BENCH_SECONDS:-5} connections=32
pids=()

stop() {
  local pid
  for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait
}
trap stop EXIT

mkdir -p "$folder/www" "$folder/nginx"
rm -f "$folder/port"
"$program" serve --port 0 --port-file "$folder/port" --log-file "$folder/log" &
pids+=($!)
for _ in {1..200}; do
  [[ -s $folder/port ]] && break
  sleep 0.05
done
readonly server=http://127.0.0.1:$(<"$folder/port")

readonly request='{"scene": "still-life", "camera": {"lens": {"f_number": 8, "focus_distance_m": 2}},
  "image": {"width": 240, "height": 160}, "quality": {"samples": 4}}'
id=$(curl -s -o "$folder/www/picture.png" -D - -H 'Content-Type: application/json' \
  -H 'Prefer: wait=60' -d "$request" "$server/v1/renders" |
  sed -n 's/^Fstop-Render-Id: \([0-9a-f]*\).*/\1/Ip')
cat >"$folder/nginx.conf" <<CONF
worker_processes 1;
daemon off;
pid $folder/nginx/pid;
error_log $folder/nginx/error.log;
events { worker_connections 1024; }
http {
  access_log $folder/nginx/access.log;
  sendfile on;
  types { image/png png; }
  client_body_temp_path $folder/nginx; proxy_temp_path $folder/nginx; fastcgi_temp_path $folder/nginx;
  uwsgi_temp_path $folder/nginx; scgi_temp_path $folder/nginx;
  server { listen 127.0.0.1:${FSTOP_NGINX_PORT:-18089}; root $folder/www; }
}
CONF
chmod -R a+rX "$folder"
nginx -c "$folder/nginx.conf" 2>/dev/null &
pids+=($!)
sleep 0.5
cat >"$folder/optics.lua" <<'LUA'
wrk.method = "POST"
wrk.headers["Content-Type"] = "application/json"
wrk.body = '{"camera": {"lens": {"focal_length_mm": 50, "f_number": 2, "focus_distance_m": 2}}}'
LUA

measure() { # name wrk-arguments...
  local name=$1 out
  shift
  out=$(wrk -t1 -c"$connections" -d"${seconds}s" --latency "$@")
  printf '%-28s %10s requests/s   p50 %s   p99 %s   %s\n' "$name" \
    "$(awk '/Requests\/sec/ {print $2}' <<<"$out")" "$(awk '$1 == "50%" {print $2}' <<<"$out")" \
    "$(awk '$1 == "99%" {print $2}' <<<"$out")" "$(grep -E 'Non-2xx|Socket errors' <<<"$out" || true)"
}
for round in 1 2 3; do
  measure "nginx, the file ($round)" "http://127.0.0.1:${FSTOP_NGINX_PORT:-18089}/picture.png"
  measure "fstop, the picture ($round)" "$server/v1/renders/$id/image"
  measure "fstop, optics ($round)" -s "$folder/optics.lua" "$server/v1/optics"
done

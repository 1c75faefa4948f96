#!/usr/bin/env bash
# Streams a file from disk and from nginx on the loopback (vcp bench stream), and prints what it took as a Markdown table; all
# forms of the report go to OUT_FOLDER.
#
# usage: tests/bench/stream_nginx.sh [--sources "disk http https 20mbit 50ms"] [--budgets "64M 256M 1G"] [--frames 24]
#                                    [--size 320x200] [--path fly] FILE.vcp [OUT_FOLDER]
#
# What is in brackets is what it takes without; a run of one source and budget takes some 20 s on two cores, `vcp bench stream` all of them.
# nginx runs with a configuration of its own, in a temporary folder, on free ports: plain, with TLS (a certificate made
# here), at 20 Mbit/s (8 connections, each limited to an eighth), and behind a proxy that delays answers by 50 ms. The server
# and the proxy run at the lowest priority: elsewhere they have processors of their own.
# Needs nginx (Debian: nginx-light), openssl and python3. The program is $VCP, or build/release/vcp.
# Exit status 1 when a run fails or an invariant breaks.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
usage() {
    sed -n '5,6p' "${BASH_SOURCE[0]}" >&2
    exit 2
}
sources="disk http https 20mbit 50ms"
budgets="64M 256M 1G"
frames=24
size=320x200
path=fly
while [[ ${1:-} == --* ]]; do
    [ $# -ge 2 ] || usage
    case $1 in
        --sources) sources=$2 ;;
        --budgets) budgets=$2 ;;
        --frames) frames=$2 ;;
        --size) size=$2 ;;
        --path) path=$2 ;;
        *) usage ;;
    esac
    shift 2
done
[ $# -ge 1 ] || usage
file=$(realpath "$1")
out=${2:-$(mktemp -d)}
vcp=${VCP:-$here/../../build/release/vcp}
nginx=$(PATH=$PATH:/usr/sbin command -v nginx) || { echo "nginx is missing; on Debian: apt-get install nginx-light" >&2; exit 1; }

work=$(mktemp -d)
proxy=
stop() {
    [ -z "$proxy" ] || kill "$proxy" 2>/dev/null || true
    [ ! -s "$work/nginx.pid" ] || kill "$(cat "$work/nginx.pid")" 2>/dev/null || true
    rm -rf "$work"
}
trap stop EXIT
mkdir -p "$out" "$work/www"
chmod 755 "$work" "$work/www"
ln -s "$file" "$work/www/scan.vcp"

# What the loopback serves stays on this machine.
unset http_proxy https_proxy all_proxy HTTP_PROXY HTTPS_PROXY ALL_PROXY
read -r plain secure limited < <(python3 -c '
import socket
all = [socket.socket() for _ in range(3)]
for s in all: s.bind(("127.0.0.1", 0))
print(*[s.getsockname()[1] for s in all])')
openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=loopback \
    -addext subjectAltName=IP:127.0.0.1 -keyout "$work/key.pem" -out "$work/certificate.pem" 2>/dev/null
user=$([ "$(id -u)" -ne 0 ] || echo "user root;")
cat >"$work/nginx.conf" <<CONF
$user
worker_processes 1;
pid $work/nginx.pid;
error_log $work/error.log;
events { worker_connections 256; }
http {
    access_log off;
    sendfile on;
    client_body_temp_path $work/body;
    proxy_temp_path $work/proxy;
    fastcgi_temp_path $work/fastcgi;
    uwsgi_temp_path $work/uwsgi;
    scgi_temp_path $work/scgi;
    root $work/www;
    server { listen 127.0.0.1:$plain; }
    server {
        listen 127.0.0.1:$secure ssl http2;
        ssl_certificate $work/certificate.pem;
        ssl_certificate_key $work/key.pem;
    }
    server { listen 127.0.0.1:$limited; limit_rate 312500; }
}
CONF
nice -n 19 "$nginx" -p "$work" -e "$work/error.log" -c "$work/nginx.conf"
coproc DELAY { exec nice -n 19 python3 "$here/delay_proxy.py" "$plain" 50; }
proxy=$DELAY_PID
read -r _ delayed <&"${DELAY[0]}"

address() {
    case $1 in
        disk) echo "$file" ;;
        http) echo "http://127.0.0.1:$plain/scan.vcp" ;;
        https) echo "https://127.0.0.1:$secure/scan.vcp" ;;
        20mbit) echo "http://127.0.0.1:$limited/scan.vcp" ;;
        50ms) echo "http://127.0.0.1:$delayed/scan.vcp" ;;
        *) echo "no such source: $1" >&2; return 1 ;;
    esac
}

models=() names=()
for source in $sources; do
    models+=("$(address "$source")")
    names+=(-e "s|$(address "$source")|$source|g" -e "s#^| ${file##*/} |#| disk |#")
done
# What nginx serves leaves the system's cache before the first run, the file itself before each from disk.
dd if="$file" iflag=nocache count=0 2>/dev/null
"$vcp" bench stream "${models[@]}" --budgets "${budgets// /,}" --paths "$path" --frames "$frames" --size "$size" --ca-file "$work/certificate.pem" --out "$out" >/dev/null || status=$?
sed -i "${names[@]}" "$out"/bench_stream.*
cat "$out/bench_stream.md"
exit "${status:-0}"

#!/usr/bin/env python3
"""A server of one folder for tests: range requests, and faults by the address's query.

usage: range_server.py FOLDER [CERTIFICATE KEY]

Prints "port N" once it listens on the loopback. GET /count says how many requests for files there were.
Query: fault=NAME, with
  whole      status 200, as of a server without ranges       status-N   status N
  shifted    the range one byte further on                   unnamed    206 without Content-Range
  short      ends before the announced length                long       one byte too many
  stall      sends the header and half the body, then waits  silent     never answers
  redirect   to the same file without a fault                loop       to itself
  ftp        redirects to another protocol                   gzip       Content-Encoding: gzip
  weak       a weak entity tag, Last-Modified as well        untagged   neither
  nomulti    the first of several ranges only
  drip       the body by one byte in 20 ms                   dripheader the same of a header line
  headers    header lines without end                        hints      answers of status 103 without end
  claims     announces a body of 10^15 bytes                 moved      to the same file, with a page that never ends
  heavy      to the same file, with a page of 10^12 bytes    missing    status 404 with a page that never ends
  reset      breaks the connection within the header         escape     Content-Range with an escape sequence and 60000 letters
  auth       status 401 unless user "user" and password "se/cret" come along
  inside     to fault=auth of the same server                away       to fault=auth of another name of it
What would never end does after 30 s. log=1: writes the file "asked" into the folder, at each request; log=all: a line each.
after=K: the fault begins with the request after K good ones. Files are read anew for each request; the
entity tag is made from time of change and size.
"""
import base64
import http.server
import os
import re
import ssl
import sys
import time
import urllib.parse

BOUNDARY = "4d2f"
MOST_SECONDS = 30
LOGIN = "Basic " + base64.b64encode(b"user:se/cret").decode()


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    folder = "."
    count = 0
    good = {}

    def log_message(self, *_):
        pass

    def answer(self, status, fields, body=b"", length=None):
        self.send_response(status)
        for name, value in fields:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        self.wfile.write(body)

    def endlessly(self, piece, pause=0.0):
        """Sends pieces until the client hangs up."""
        end = time.monotonic() + MOST_SECONDS
        while time.monotonic() < end:
            self.wfile.write(piece)
            time.sleep(pause)
        self.close_connection = True

    def send_broken(self, path, fault):
        """Answers that are wrong before the file matters; False: it is none of these."""
        start = b"HTTP/1.1 206 Partial Content\r\n"
        to = ("Location: %s\r\n" % urllib.parse.urlsplit(self.path).path).encode()
        if fault == "dripheader":
            self.wfile.write(start + b"X-Slow: ")
            self.endlessly(b"x", 0.02)
        elif fault == "headers":
            self.wfile.write(start)
            self.endlessly(b"X-More: " + b"x" * 500 + b"\r\n")
        elif fault == "hints":
            self.endlessly(b"HTTP/1.1 103 Early Hints\r\nLink: </x>\r\n\r\n")
        elif fault == "moved":
            self.wfile.write(b"HTTP/1.1 302 Found\r\n" + to + b"Connection: close\r\n\r\n")
            self.endlessly(b"moved ", 0.02)
        elif fault == "heavy":
            self.wfile.write(b"HTTP/1.1 302 Found\r\n" + to + b"Content-Length: 1000000000000\r\n\r\n")
            self.endlessly(b"moved " * 1000)
        elif fault == "missing":
            self.wfile.write(b"HTTP/1.1 404 Not Found\r\nConnection: close\r\n\r\n")
            self.endlessly(b"sorry ", 0.02)
        elif fault == "reset":
            self.wfile.write(start + b"Content-Ra")
            self.close_connection = True
        elif fault in ("inside", "away"):
            host = "127.0.0.1" if fault == "inside" else "localhost"
            to = "http://%s:%d/%s?fault=auth" % (host, self.server.server_address[1], os.path.basename(path))
            self.answer(302, [("Location", to)], b"moved")
        elif fault == "auth" and self.headers.get("Authorization") != LOGIN:
            self.answer(401, [("WWW-Authenticate", "Basic")], b"who?")
        else:
            return False
        return True

    def do_GET(self):
        address = urllib.parse.urlsplit(self.path)
        if address.path == "/count":
            return self.answer(200, [], str(Handler.count).encode())
        Handler.count += 1
        query = urllib.parse.parse_qs(address.query)
        fault = query.get("fault", [""])[0]
        if "log" in query:
            keeps = query["log"] == ["all"]
            with open(os.path.join(Handler.folder, "asked"), "a" if keeps else "w") as file:
                file.write(self.path + ("\n" if keeps else ""))
        seen = Handler.good.get(self.path, 0)
        Handler.good[self.path] = seen + 1
        if seen < int(query.get("after", ["0"])[0]) and fault not in ("weak", "untagged", "nomulti"):
            fault = ""
        path = os.path.join(Handler.folder, os.path.basename(address.path))
        if not os.path.isfile(path):
            return self.answer(404, [], b"no such file")
        if fault.startswith("status-"):
            return self.answer(int(fault[7:]), [], b"a page that says why")
        if fault in ("redirect", "loop", "ftp"):
            to = {"redirect": address.path, "loop": self.path, "ftp": "ftp://127.0.0.1/x.vcp"}[fault]
            return self.answer(302, [("Location", to)], b"moved")
        if not self.send_broken(path, fault):
            self.send_ranges(path, fault)

    def send_ranges(self, path, fault):
        with open(path, "rb") as file:
            data = file.read()
        changed = os.stat(path)
        tag = '"%x-%x"' % (changed.st_mtime_ns, changed.st_size)
        date = self.date_time_string(int(changed.st_mtime))
        fields = [("ETag", "W/" + tag if fault == "weak" else tag), ("Last-Modified", date)]
        if fault == "untagged":
            fields = []
        wanted = self.headers.get("If-Match")
        if wanted is not None and (wanted != tag or fault == "weak"):
            return self.answer(412, [])
        since = self.headers.get("If-Unmodified-Since")
        if since is not None and since != date:
            return self.answer(412, [])
        ranges = []
        for first, last in re.findall(r"(\d+)-(\d+)", self.headers.get("Range", "")):
            ranges.append((int(first), min(int(last), len(data) - 1)))
        if fault == "whole" or not ranges:
            return self.answer(200, fields, data)
        if ranges[0][0] >= len(data):
            return self.answer(416, [("Content-Range", "bytes */%d" % len(data))])
        if len(ranges) > 1 and fault != "nomulti":
            return self.send_parts(data, ranges, fields)
        first, last = ranges[0]
        self.send_range(data, first, last, fields, fault)

    def send_parts(self, data, ranges, fields):
        body = b""
        for first, last in ranges:
            head = "\r\n--%s\r\nContent-Type: application/octet-stream\r\nContent-Range: bytes %d-%d/%d\r\n\r\n"
            body += (head % (BOUNDARY, first, last, len(data))).encode() + data[first:last + 1]
        body += ("\r\n--%s--\r\n" % BOUNDARY).encode()
        self.answer(206, fields + [("Content-Type", "multipart/byteranges; boundary=" + BOUNDARY)], body)

    def send_range(self, data, first, last, fields, fault):
        if fault == "shifted":
            first, last = first + 1, last + 1
        if fault == "escape":
            fields = fields + [("Content-Range", "bytes \x1b]0;title\x07" + "x" * 60000)]
        elif fault != "unnamed":
            fields = fields + [("Content-Range", "bytes %d-%d/%d" % (first, last, len(data)))]
        if fault == "gzip":
            fields = fields + [("Content-Encoding", "gzip")]
        body = data[first:last + 1]
        if fault == "long":
            return self.answer(206, fields, body + b"x")
        if fault == "silent":
            time.sleep(MOST_SECONDS)
        if fault == "claims":
            return self.answer(206, fields, body, 10**15)
        if fault == "drip":
            self.answer(206, fields, b"", len(body))
            for byte in range(min(len(body), 50 * MOST_SECONDS)):
                self.wfile.write(body[byte:byte + 1])
                time.sleep(0.02)
            self.close_connection = True
            return None
        if fault in ("short", "stall"):
            self.answer(206, fields, body[:len(body) // 2], len(body))
            self.wfile.flush()
            if fault == "stall":
                time.sleep(MOST_SECONDS)
            self.close_connection = True
            return None
        return self.answer(206, fields, body)


class Server(http.server.ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, *_):
        pass  # clients that hang up are what the tests are about


def main():
    Handler.folder = sys.argv[1]
    server = Server(("127.0.0.1", 0), Handler)
    if len(sys.argv) > 2:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(sys.argv[2], sys.argv[3])
        server.socket = context.wrap_socket(server.socket, server_side=True)
    print("port", server.server_address[1], flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()

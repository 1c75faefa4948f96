"""fetch_models against a server on this machine that misbehaves in every way that it must survive.

    fetch_models_test.py FETCH_MODELS [unittest options]
"""
import fcntl
import gzip
import hashlib
import http.server
import io
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
import unittest
import zipfile

FETCH_MODELS = pathlib.Path(sys.argv[1]).resolve()
MODELS = FETCH_MODELS.parent / "models.txt"


def meshBytes(seed, size):
    return random.Random(seed).randbytes(size)


def inTar(member, content):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        for name, data in (("stray.txt", b"not wanted"), (member, content)):
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return buffer.getvalue()


def inZip(member, content):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("stray.txt", b"not wanted")
        archive.writestr(member, content)
    return buffer.getvalue()


class Faults:
    """What the server does wrong; counts are used up."""

    def __init__(self):
        self.ranges = True        # serves ranges
        self.validators = True    # says which version of a file it serves
        self.lengths = True       # says how long an answer is
        self.truncate = []        # bytes after which the next answers end
        self.statuses = []        # statuses of the next answers; 200 for the file
        self.redirect = False     # to /moved/
        self.endless = None       # an event: waits for it after half of the answer


class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        faults, files = self.server.faults, self.server.files
        asked = self.headers.get("Range")
        self.server.requests.append((self.path, asked))
        status = faults.statuses.pop(0) if faults.statuses else 200
        if status != 200:
            return self.send_error(status)
        if faults.redirect and not self.path.startswith("/moved/"):
            self.send_response(302)
            self.send_header("Location", "/moved" + self.path)
            self.send_header("ETag", '"of the redirection"')
            return self.end_headers()
        body = files.get(self.path.removeprefix("/moved"))
        if body is None:
            return self.send_error(404)
        tag = '"%s"' % hashlib.sha256(body).hexdigest()[:16]
        start, length = 0, len(body)
        unchanged = self.headers.get("If-Range") in (None, tag)
        if asked and faults.ranges and unchanged:
            start = int(re.fullmatch(r"bytes=(\d+)-", asked)[1])
            if start >= length:
                return self.send_error(416)
            self.send_response(206)
            self.send_header("Content-Range", "bytes %d-%d/%d" % (start, length - 1, length))
        else:
            self.send_response(200)
        if faults.lengths:
            self.send_header("Content-Length", str(length - start))
        if faults.validators:
            self.send_header("ETag", tag)
        self.end_headers()
        part = body[start:]
        if faults.truncate:
            part = part[: faults.truncate.pop(0)]
        if faults.endless:
            self.wfile.write(part[: len(part) // 2])
            self.wfile.flush()
            faults.endless.wait(60)
            return
        self.wfile.write(part)

    def log_message(self, *_):
        pass


class FetchModels(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.out = self.root / "out of the way"
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.server.faults, self.server.files, self.server.requests = Faults(), {}, []
        self.faults = self.server.faults
        threading.Thread(target=self.server.serve_forever, args=(0.01,), daemon=True).start()
        self.addCleanup(self.server.server_close)
        self.addCleanup(self.server.shutdown)
        self.address = "http://127.0.0.1:%d" % self.server.server_port
        self.table = "terms free\npage https://example.org/terms\ntext Do what you like,\ntext but say who made it.\n"
        self.mesh = meshBytes(1, 300_000)

    def add(self, name, file, archive, member="", known=True, **keys):
        """Puts a model into the table and its archive onto the server."""
        self.server.files["/" + file] = archive
        fields = {"title": name.title(), "triangles": "12", "url": self.address + "/" + file, "file": file,
                  "mesh": name + ".ply", "under": "free"}
        if member:
            fields["member"] = member
        if known:
            fields |= {"bytes": str(len(archive)), "sha256": hashlib.sha256(archive).hexdigest()}
        fields |= keys
        self.table += "\nmodel %s\n" % name + "".join("%s %s\n" % pair for pair in fields.items() if pair[1] is not None)

    def addStatue(self, **keys):
        keys = {"member": "scan/deep/statue.ply"} | keys
        self.add("statue", "statue.tar.gz", inTar("scan/deep/statue.ply", self.mesh), **keys)

    def command(self, *arguments):
        (self.root / "table.txt").write_text(self.table)
        return [str(FETCH_MODELS), "--table", str(self.root / "table.txt"), "-o", str(self.out), *arguments]

    def run_(self, *arguments):
        return subprocess.run(self.command(*arguments), capture_output=True, text=True, timeout=120)

    def fetches(self, *arguments):
        result = self.run_(*arguments)
        self.assertEqual((result.returncode, result.stderr), (0, ""), result.stdout)
        return result.stdout

    def refuses(self, *arguments, saying, status=1):
        result = self.run_(*arguments)
        self.assertEqual(result.returncode, status, result.stderr)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertRegex(result.stderr, "^fetch_models: .*" + re.escape(saying))
        return result.stdout

    def assertThere(self, *names):
        self.assertEqual(sorted(path.name for path in self.out.iterdir()), sorted(names))

    def ranges(self):
        return [asked for _, asked in self.server.requests]

    # What it is for.

    def testEveryKindOfArchiveBecomesOneMesh(self):
        self.addStatue()
        self.add("vase", "vase (1840).zip", inZip("a vase (1840).obj", self.mesh), "a vase (1840).obj", mesh="vase.obj",
                 url=self.address + "/vase.zip")
        self.server.files["/vase.zip"] = self.server.files["/vase (1840).zip"]
        self.add("coin", "coin.ply.gz", gzip.compress(self.mesh))
        self.add("nail", "nail.ply", self.mesh, mesh="nail.ply")
        said = self.fetches("all")
        self.assertThere("statue.tar.gz", "statue.ply", "vase (1840).zip", "vase.obj", "coin.ply.gz", "coin.ply", "nail.ply")
        for mesh in ("statue.ply", "vase.obj", "coin.ply", "nail.ply"):
            self.assertEqual((self.out / mesh).read_bytes(), self.mesh)
        self.assertRegex(said, r"next: vcp build .*vase\.obj -o .*vase\.vcp")

    def testSizeAndTermsComeBeforeTheFirstByte(self):
        self.addStatue()
        self.faults.statuses = [404]
        said = self.refuses("statue", saying="answers 404")
        size = "%d kB" % -(-len(self.server.files["/statue.tar.gz"]) // 1000)
        for text in (size + ", " + self.address, "https://example.org/terms", "Do what you like,", "but say who made it."):
            self.assertIn(text, said)

    def testAgainIsNothingToDo(self):
        self.addStatue()
        self.fetches("statue")
        before = {path.name: path.stat().st_mtime_ns for path in self.out.iterdir()}
        self.server.requests.clear()
        self.assertIn("here already", self.fetches("statue"))
        self.assertEqual(before, {path.name: path.stat().st_mtime_ns for path in self.out.iterdir()})
        (self.out / "statue.tar.gz").unlink()
        self.assertIn("here already", self.fetches("statue"))
        self.assertEqual(self.server.requests, [])

    def testAMeshThatWasRemovedIsUnpackedAgain(self):
        self.addStatue()
        self.fetches("statue")
        (self.out / "statue.ply").unlink()
        self.server.requests.clear()
        self.fetches("statue")
        self.assertEqual((self.out / "statue.ply").read_bytes(), self.mesh)
        self.assertEqual(self.server.requests, [])

    def testAMirrorStandsInForTheAddress(self):
        self.addStatue(url="http://127.0.0.1:1/nowhere.tar.gz")
        self.server.files["/there/statue.tar.gz"] = self.server.files.pop("/statue.tar.gz")
        self.fetches("statue", "--mirror", self.address + "/there/")
        self.assertEqual(self.server.requests, [("/there/statue.tar.gz", None)])

    def testRedirectionsAreFollowed(self):
        self.addStatue()
        self.faults.redirect = True
        self.faults.truncate = [1000]
        self.fetches("statue")
        self.assertIn(("/moved/statue.tar.gz", "bytes=1000-"), self.server.requests)

    # Downloads that stop.

    def testATruncatedDownloadGoesOnWhereItStopped(self):
        self.addStatue()
        self.faults.truncate = [1000, 50_000]
        self.fetches("statue")
        self.assertEqual(self.ranges(), [None, "bytes=1000-", "bytes=51000-"])
        self.assertThere("statue.tar.gz", "statue.ply")

    def testTheNextRunGoesOnWhereThisOneStopped(self):
        for known in (True, False):
            with self.subTest(known=known):
                self.out = self.root / str(known)
                self.table, self.server.requests[:] = self.table.split("\nmodel")[0], []
                self.addStatue(known=known)
                self.refusesAfterTheFirstAnswer()
                self.assertThere("statue.tar.gz.part", "statue.tar.gz.part.headers")
                self.server.requests.clear()
                self.fetches("statue")
                self.assertEqual(self.ranges(), ["bytes=1000-"])
                self.assertEqual((self.out / "statue.tar.gz").read_bytes(), self.server.files["/statue.tar.gz"])

    def refusesAfterTheFirstAnswer(self):
        """One answer that is cut, then a server that knows the file no more."""
        self.faults.truncate, self.faults.statuses = [1000], [200, 404]
        self.refuses("statue", saying="answers 404")

    def testWithoutRangesItStartsOver(self):
        self.addStatue()
        self.faults.ranges = False
        self.faults.truncate = [1000]
        self.fetches("statue")
        self.assertEqual(self.ranges(), [None, "bytes=1000-", None])

    def testWithoutLengthsATruncationIsNoticed(self):
        self.addStatue()
        self.faults.lengths = False
        self.faults.truncate = [1000]
        self.fetches("statue")
        self.assertEqual(self.ranges(), [None, "bytes=1000-"])

    def testAServerThatNeverEndsAnAnswerIsGivenUp(self):
        self.addStatue()
        self.faults.ranges = False
        self.faults.truncate = [1000] * 20
        self.refuses("statue", "--tries", "2", saying="goes on from there")
        self.assertLess(len(self.server.requests), 10)

    def testABusyServerIsAskedAgain(self):
        self.addStatue()
        self.faults.statuses = [503]
        self.fetches("statue")
        self.assertEqual(len(self.server.requests), 2)

    def testAWholePartIsNotFetchedAgain(self):
        self.addStatue()
        self.out.mkdir()
        (self.out / "statue.tar.gz.part").write_bytes(self.server.files["/statue.tar.gz"])
        self.fetches("statue")
        self.assertEqual(self.server.requests, [])

    def testAPartOfSomethingElseIsThrownAway(self):
        self.addStatue()
        self.out.mkdir()
        for junk in (b"x" * 1000, b"x" * 1_000_000):
            (self.out / "statue.tar.gz.part").write_bytes(junk)
            self.fetches("statue")
            self.assertEqual((self.out / "statue.ply").read_bytes(), self.mesh)
            (self.out / "statue.ply").unlink()
            (self.out / "statue.tar.gz").unlink()

    def testAFileThatChangedMeanwhileIsNotGluedTogether(self):
        self.addStatue(known=False)
        self.refusesAfterTheFirstAnswer()
        changed = inTar("scan/deep/statue.ply", meshBytes(2, 200_000))
        self.server.files["/statue.tar.gz"] = changed
        self.fetches("statue")
        self.assertEqual((self.out / "statue.tar.gz").read_bytes(), changed)

    def testWithoutSumOrVersionItStartsOver(self):
        self.addStatue(known=False)
        self.faults.validators = False
        self.faults.redirect = True  # whose version is not the file's
        self.faults.truncate = [1000]
        self.fetches("statue")
        self.assertEqual(self.ranges(), [None] * 4)

    def testAnInterruptionEndsTheDownloadAndIsResumed(self):
        self.addStatue()
        self.faults.endless = threading.Event()
        self.addCleanup(self.faults.endless.set)
        for stop in (signal.SIGINT, signal.SIGTERM):
            process = subprocess.Popen(self.command("statue"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            part = self.out / "statue.tar.gz.part"
            deadline = time.monotonic() + 60
            while time.monotonic() < deadline and not (self.server.requests and part.exists() and part.stat().st_size > 1000):
                time.sleep(0.01)
            self.server.requests.clear()
            process.send_signal(stop)
            error = process.communicate(timeout=60)[1]
            self.assertEqual((process.returncode, error.count("\n")), (1, 1), error)
            self.assertIn("interrupted", error)
            self.assertThere("statue.tar.gz.part", "statue.tar.gz.part.headers")
        self.faults.endless.set()
        self.faults.endless = None
        self.fetches("statue")
        self.assertRegex(self.ranges()[0], r"bytes=[1-9]\d*-")
        self.assertThere("statue.tar.gz", "statue.ply")

    # Downloads that are wrong.

    def testAWrongSizeIsRefused(self):
        self.addStatue(bytes="1000")
        self.refuses("statue", saying="instead of 1000")
        self.assertThere()
        self.table = self.table.replace("bytes 1000\n", "bytes 10000000\n")
        self.refuses("statue", "--tries", "1", saying="goes on from there")
        self.assertEqual([path.name for path in self.out.glob("statue.ply*")], [])

    def testNothingAtAllIsRefused(self):
        self.add("lost", "lost.ply.gz", b"", known=False)
        self.refuses("lost", saying="is empty")
        self.assertThere()

    def testAWrongChecksumIsRefused(self):
        self.addStatue(sha256="0" * 64)
        self.refuses("statue", saying="instead of 0000")
        self.assertThere()

    def testAnArchiveThatWasSpoiledIsNamed(self):
        self.addStatue()
        self.fetches("statue")
        archive = self.out / "statue.tar.gz"
        spoiled = bytearray(archive.read_bytes())
        spoiled[len(spoiled) // 2] ^= 1
        archive.write_bytes(spoiled)
        self.refuses("statue", saying="remove it to fetch it again")
        self.assertEqual(archive.read_bytes(), spoiled)

    def testTheFirstDownloadIsTrustedAndLaterOnesMustEqualIt(self):
        self.addStatue(known=False)
        said = self.fetches("statue")
        sum_ = hashlib.sha256(self.server.files["/statue.tar.gz"]).hexdigest()
        self.assertIn("trusted on first use: SHA-256 " + sum_, said)
        self.assertEqual((self.out / "statue.tar.gz.sha256").read_text(), sum_ + "  statue.tar.gz\n")
        (self.out / "statue.tar.gz").unlink()
        (self.out / "statue.ply").unlink()
        self.server.files["/statue.tar.gz"] = inTar("scan/deep/statue.ply", meshBytes(2, 1000))
        self.refuses("statue", saying="instead of " + sum_)
        self.assertThere("statue.tar.gz.sha256")

    def testAnArchiveWithoutTheMeshLeavesNothingBehind(self):
        self.addStatue(member="somewhere/else.ply")
        self.refuses("statue", saying="cannot be unpacked")
        self.assertThere("statue.tar.gz")

    def testABrokenArchiveLeavesNothingBehind(self):
        self.add("coin", "coin.ply.gz", gzip.compress(self.mesh)[:-20000])
        self.add("vase", "vase.zip", b"no zip file", "vase.obj")
        for name in ("coin", "vase"):
            self.refuses(name, saying="cannot be unpacked")
        self.assertThere("coin.ply.gz", "vase.zip")

    # Everything else that goes wrong.

    def testOneFailureDoesNotStopTheOthers(self):
        self.add("lost", "lost.ply.gz", gzip.compress(self.mesh))
        del self.server.files["/lost.ply.gz"]
        self.addStatue()
        self.refuses("lost", "statue", saying="lost: " + self.address + "/lost.ply.gz answers 404")
        self.assertTrue((self.out / "statue.ply").exists())

    def testNobodyAnswers(self):
        self.addStatue(url="http://127.0.0.1:1/statue.tar.gz")
        self.refuses("statue", "--tries", "1", saying="statue: http://127.0.0.1:1/statue.tar.gz: ")

    def testTooLittleSpaceIsSaidBeforeTheDownload(self):
        self.addStatue(unpacked=str(10**17))
        self.refuses("statue", saying="statue: needs 1000")
        self.assertEqual(self.server.requests, [])

    def testAFolderThatCannotBeMade(self):
        self.addStatue()
        self.out = self.root / "table.txt" / "inside"
        self.refuses("statue", saying=str(self.out))

    def testTwoAtOnce(self):
        self.addStatue()
        self.out.mkdir()
        held = os.open(self.out, os.O_RDONLY)
        self.addCleanup(os.close, held)
        fcntl.flock(held, fcntl.LOCK_EX)
        self.refuses("statue", saying="another fetch_models is at work")

    def testWrongUsage(self):
        self.addStatue()
        for arguments, saying in (
            ([], "which model?"), (["stattue"], "unknown model 'stattue'"), (["--fast", "statue"], "unknown option '--fast'"),
            (["statue", "-o"], "-o wants a value"), (["statue", "--tries", "0"], "--tries wants"),
            (["statue", "--mirror", "ftp://x"], "--mirror wants"), (["statue", "list"], "unknown model 'list'")):
            with self.subTest(arguments=arguments):
                self.refuses(*arguments, saying=saying, status=2)
        self.refuses("--table", str(self.root / "none.txt"), "statue", saying="none.txt: the list of models cannot be read")
        self.assertEqual(self.server.requests, [])

    # The list that is shipped.

    def testTheShippedListIsComplete(self):
        models, terms, record = {}, {}, None
        for line in MODELS.read_text().splitlines():
            key, _, value = line.partition(" ")
            if key in ("model", "terms"):
                record = (models if key == "model" else terms).setdefault(value, {})
            elif line and key != "#":
                record[key] = record.get(key, "") + value
        self.assertGreaterEqual(set(models), {"bunny", "armadillo", "dragon", "happy_buddha", "lucy", "thai_statue", "asian_dragon"})
        for name, model in models.items():
            with self.subTest(name=name):
                self.assertGreaterEqual(set(model), {"title", "triangles", "url", "file", "mesh", "under"})
                self.assertEqual(set(model) - {"title", "triangles", "url", "file", "mesh", "under", "bytes", "sha256", "about",
                                               "member", "unpacked"}, set())
                self.assertRegex(model["url"], "^https://")
                self.assertRegex(model.get("sha256", "0" * 64), "^[0-9a-f]{64}$")
                self.assertRegex(model["triangles"] + model.get("bytes", "") + model.get("unpacked", ""), "^[0-9]+$")
                self.assertEqual("member" in model, model["file"].endswith((".tar.gz", ".zip")))
                self.assertTrue(model["file"].endswith(".gz") or model["file"].endswith(".zip"))
                self.assertGreaterEqual(set(terms[model["under"]]), {"page", "text"})
        files = [model["file"] for model in models.values()] + [model["mesh"] for model in models.values()]
        self.assertEqual(len(files), len(set(files)))
        said = subprocess.run([str(FETCH_MODELS), "list"], capture_output=True, text=True, check=True).stdout
        for name in [*models, *terms]:
            self.assertRegex(said, "(?m)^%s\\b" % name)

    def testHelp(self):
        said = subprocess.run([str(FETCH_MODELS), "--help"], capture_output=True, text=True, check=True).stdout
        for option in ("list", "-o", "--mirror", "--tries", "--table"):
            self.assertIn(option, said)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])

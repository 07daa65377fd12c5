"""Checks the built site: links, the weight of the start page, widths in a browser.

python site/check.py FOLDER BROWSER: FOLDER has `html`.
"""

import json
import re
import subprocess
import sys
import tempfile
import threading
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import ClassVar

# What the start page may weigh, with all that it loads by itself, and the widths of windows.
BYTES = 1_000_000
WIDTHS = (390, 1400)
# A page that loads all pages into frames and says which of them do not fit.
FRAMES = """<!doctype html><title>check</title><body><script>
const wrong = [];
async function look(page) {
  const frame = document.createElement("iframe");
  Object.assign(frame.style, { width: `${WIDTHS[0]}px`, height: "900px", border: 0 });
  frame.src = `/${page}`;
  await new Promise((done) => { frame.onload = done; document.body.append(frame); });
  const { documentElement: html, images } = frame.contentDocument;
  for (const width of WIDTHS) {
    frame.style.width = `${width}px`;
    await new Promise(requestAnimationFrame);
    if (html.scrollWidth > width) wrong.push(`${page} is ${html.scrollWidth} pixels wide in ${width}`);
  }
  for (const image of images) {
    if (image.complete && !image.naturalWidth) wrong.push(`${page}: the picture ${image.src} is not shown`);
  }
  frame.remove();
}
(async () => {
  for (const page of PAGES) await look(page);
  await fetch("/checked", { method: "POST", body: JSON.stringify(wrong) });
})();
</script>"""


class Server(SimpleHTTPRequestHandler):
    """Serves the site, and takes what a page has found."""

    found: ClassVar[dict[str, list[str]]] = {}
    checked = threading.Event()
    loaded: ClassVar[set[str]] = set()
    body = b""

    def log_message(self, *_):
        """Says nothing."""

    def do_GET(self):
        """Sends a file, or the page that checks all others."""
        if self.path != "/check.html":
            self.loaded.add(self.path.split("?")[0])
            super().do_GET()
            return
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(self.body)

    def do_POST(self):
        """Takes the findings."""
        Server.found["widths"] = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        self.checked.set()


class Servers(ThreadingHTTPServer):
    """Serves in threads, and says nothing when a browser is closed while it loads a file."""

    def handle_error(self, request, client_address):
        """Says nothing of closed connections."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)


def browse(browser: str, address: str, wait: threading.Event, seconds: float) -> bool:
    """Opens a page in a browser without a window until an event, and says whether it came."""
    flags = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--window-size=1500,1000",
    ]
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [
            browser,
            *flags,
            "--window-size=1500,1000",
            f"--user-data-dir={profile}",
            "--remote-debugging-port=0",
            address,
        ]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        came = wait.wait(seconds)
        process.terminate()
        process.wait()
    return came


def main() -> None:
    """Checks everything and ends with what is wrong."""
    folder, browser = Path(sys.argv[1]), sys.argv[2]
    html = folder / "html"
    pages = sorted(str(path.relative_to(html).parent) for path in html.rglob("index.html"))
    pages = ["" if page == "." else f"{page}/" for page in pages]
    body = FRAMES.replace("PAGES", json.dumps(pages)).replace("WIDTHS", json.dumps(WIDTHS))
    Server.body = body.encode()
    server = Servers(("127.0.0.1", 0), partial(Server, directory=str(html)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    address = f"http://127.0.0.1:{server.server_address[1]}"
    wrong = []

    # All that a browser asks for within five seconds of opening the start page.
    Server.loaded.clear()
    browse(browser, f"{address}/", threading.Event(), 5)
    loaded = {path for path in Server.loaded if (html / path.lstrip("/")).exists()}
    files = [html / path.lstrip("/") for path in loaded]
    files = [path / "index.html" if path.is_dir() else path for path in files]
    weight = sum(path.stat().st_size for path in files)
    print(f"site: the start page has {len(files)} files of {weight / 1000:.0f} KB")
    if len(files) < 3 or weight > BYTES:
        wrong.append(f"the start page has {len(files)} files of {weight} bytes; at most {BYTES} are allowed")
        wrong += [f"  {path.stat().st_size:9} {path.relative_to(html)}" for path in files]

    if browse(browser, f"{address}/check.html", Server.checked, 240):
        wrong += Server.found["widths"]
        print(f"site: {len(pages)} pages in windows {' and '.join(map(str, WIDTHS))} pixels wide")
    else:
        wrong.append("the browser has not looked at all pages in 240 s")

    # Anchors are mkdocs' business, which checks them faster.
    command = [Path(sys.executable).parent / "linkchecker", "--no-robots", "--no-status", address]
    done = subprocess.run(command, capture_output=True, text=True)
    counts = re.search(r"(\d+) links in \d+ URLs checked.*?(\d+) errors? found", done.stdout, re.DOTALL)
    if done.returncode or not counts or int(counts[1]) < len(pages):
        wrong.append(done.stdout + done.stderr)
    else:
        print(f"site: {counts[1]} links, none broken")
    for line in wrong:
        print(f"site: {line}", file=sys.stderr)
    sys.exit(bool(wrong))


main()

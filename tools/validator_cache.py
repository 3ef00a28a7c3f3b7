"""Give the validator of RO-Crates the one document that it would fetch: ``python tools/validator_cache.py CACHE``.

It reads the JSON-LD context of RO-Crate 1.1 from the network; the library rocrate has it as a file, in versions before
0.15. What is written is the cache that ``rocrate-validator --offline --cache-path CACHE`` reads.
"""

import sys
from io import BytesIO
from pathlib import Path

import rocrate
from requests.adapters import BaseAdapter, HTTPAdapter
from requests_cache import CachedSession
from urllib3 import HTTPResponse

CONTEXT = "https://w3id.org/ro/crate/1.1/context"


class FromFile(BaseAdapter):
    """Answers every request with a file."""

    def send(self, request, **options):
        """Response to a request, whatever it asks for."""
        content = (Path(rocrate.__file__).parent / "data/ro-crate.jsonld").read_bytes()
        assert f'"@id": "{CONTEXT}"'.encode() in content, "this version of rocrate has the context of another RO-Crate"
        headers = {"Content-Type": "application/ld+json"}
        answer = HTTPResponse(BytesIO(content), headers, 200, preload_content=False, request_url=request.url)
        return HTTPAdapter().build_response(request, answer)

    def close(self):
        """Nothing is open."""


if __name__ == "__main__":
    session = CachedSession(sys.argv[1], backend="sqlite", expire_after=-1)
    session.mount("https://", FromFile())
    session.get(CONTEXT)

#!/usr/bin/env python3
"""Writes the first inputs of the fuzz targets into fuzz/corpus/: requests from openapi/examples/, and small files
of every format. Replaces seeds of earlier runs. Needs only the standard library."""

import gzip
import json
import struct
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CORPUS = ROOT / "fuzz" / "corpus"
EXAMPLES = ROOT / "openapi" / "examples"


def main():
    requests = [json.loads(path.read_text()) for path in sorted(EXAMPLES.glob("*.json")) if path.stem != "problems"]
    bodies = [example["request"] for example in requests if isinstance(example.get("request"), dict)]
    for index, body in enumerate(bodies):
        text = json.dumps(body, separators=(",", ":")).encode()
        # The first byte chooses the operation.
        keep("requests_json", index, bytes([index]) + text)
        keep("requests_tensors", index, bytes([index]) + safetensors({"values": [1.0, 2.0]}, body))
        keep("compressed", index, b"\0" + gzip.compress(text, mtime=0))
    keep("clouds_npy", 0, npy("<f8", "d"))
    keep("clouds_npy", 1, npy(">f4", "f", fortran=True))
    keep("clouds_ply", 0, ply("ascii", b"0 0 1\n1 0 0\n0 1 0\n"))
    keep("clouds_ply", 1, ply("binary_little_endian", struct.pack("<9d", *range(9)), "double"))
    keep("cloud_hash", 0, bytes(64))
    keep("stored", 0, bytes(32) + b"gramian cloud 1\n" + bytes(200))
    keep("stored", 1, bytes(32) + b'{"path":"/v1/normals","headers":[]}\n{}' + bytes(32))
    for index, text in enumerate(["s3://bucket/prefix", "https://a.example,http://localhost:3000", "0" * 64, KEYS]):
        keep("texts", index, text.encode())


KEYS = '[[key]]\nname = "a"\nhash = "blake3:' + "0" * 64 + '"\nrequests_per_minute = 6\nview = "b"\n'


def keep(target, index, data):
    path = CORPUS / target / f"seed-{index:02}"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data)


def safetensors(tensors, request):
    """Encodes tensors of float64 as safetensors, with the other fields as JSON text in the metadata."""
    header, data = {"__metadata__": {"request": json.dumps(request)}}, b""
    for name, numbers in tensors.items():
        header[name] = {"dtype": "F64", "shape": [len(numbers)], "data_offsets": [len(data), len(data) + 8 * len(numbers)]}
        data += struct.pack(f"<{len(numbers)}d", *numbers)
    text = json.dumps(header).encode()
    return struct.pack("<Q", len(text)) + text + data


def npy(descr, code, fortran=False):
    text = f"{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': (2, 3), }}\n".encode()
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + struct.pack(f"{descr[0]}6{code}", *range(6))


def ply(form, data, kind="float"):
    properties = "".join(f"property {kind} {axis}\n" for axis in "xyz")
    return f"ply\nformat {form} 1.0\nelement vertex 3\n{properties}end_header\n".encode() + data


if __name__ == "__main__":
    main()

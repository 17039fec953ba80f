#!/usr/bin/env python3
"""Writes the first inputs of each fuzz target, small files of every kind that it reads, below corpus/.

Files that are called found-* once ended a target; they are kept beside these.
"""
import io
import json
import struct
import zipfile
import zlib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent

HOST = b"Host: localhost\r\n"
OPTICS = b'{"camera": {"lens": {"focal_length_mm": 50, "f_number": 2}}}'

SCENE = {
    "format": "fstop-scene/1",
    "title": "t",
    "description": "d",
    "textures": {"card": {"file": "card.png", "color_space": "linear", "filter": "bilinear", "wrap": "clamp"}},
    "materials": {
        "wall": {"model": "unlit", "emission": {"texture": "card", "scale": [1, 1, 1]}},
        "ball": {"model": "blinn-phong", "ambient": [0, 0, 0], "diffuse": [0.8, 0.3, 0.2], "specular": [1, 1, 1],
                 "shininess": 40, "reflection": 0.5, "transmission": 0.25, "ior": 1.5},
    },
    "objects": [
        {"type": "quad", "corner_m": [-4, -4, -6], "edge_u_m": [8, 0, 0], "edge_v_m": [0, 8, 0], "material": "wall"},
        {"type": "sphere", "center_m": [0, 0, -2], "radius_m": 0.3, "material": "ball", "velocity_m_s": [1, 0, 0]},
        {"type": "mesh", "file": "m.obj", "material": "ball", "interpolation": "flat"},
    ],
    "lights": [
        {"type": "directional", "direction": [-1, -1, -1], "intensity": [1, 1, 1]},
        {"type": "point", "position_m": [0, 1, 0], "intensity": [1, 1, 1], "attenuation": [1, 0, 1]},
        {"type": "spot", "position_m": [0, 1, 0], "direction": [0, -1, 0], "exponent": 2, "intensity": [1, 1, 1]},
        {"type": "area", "corner_m": [0, 2, 0], "edge_u_m": [1, 0, 0], "edge_v_m": [0, 0, 1], "intensity": [1, 1, 1]},
    ],
    "ambient_light": [0.2, 0.2, 0.2],
    "background": [0, 0, 0.5],
}

TRIANGLE_OBJ = b"v 0 0 -1\nv 1 0 -1\nv 0 1 -1\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\nf 1/1/1 2/2/1 -1/-1/-1\n"


def chunk(data: bytes, extension: bytes = b"") -> bytes:
    return b"%x" % len(data) + extension + b"\r\n" + data + b"\r\n"


def framing() -> dict[str, bytes]:
    head = b"POST /v1/optics HTTP/1.1\r\n" + HOST + b"Content-Type: application/json\r\n"
    length = b"Content-Length: %d\r\n" % len(OPTICS)
    wires = {
        "get": b"\r\nGET /livez?x=1 HTTP/1.1\r\n" + HOST + b"\r\nGET / HTTP/1.1\r\n",
        "absolute": b"GET http://localhost/v1/limits HTTP/1.1\r\n" + HOST + b"\r\n",
        "old": b"GET / HTTP/1.0\r\nConnection: keep-alive\r\n\r\n",
        "options": b"OPTIONS * HTTP/1.1\r\n" + HOST + b"Origin: https://a.example\r\n"
                   b"Access-Control-Request-Method: PUT\r\n\r\n",
        "length": head + length + b"\r\n" + OPTICS + b"GET / HTTP/1.1\r\n",
        "chunks": head + b"Transfer-Encoding: chunked\r\n\r\n" + chunk(OPTICS[:20], b";a=\"b\"") + chunk(OPTICS[20:])
                  + b"0\r\n\r\n",
        "trailer": head + b"Transfer-Encoding: chunked\r\n\r\n" + chunk(OPTICS) + b"0\r\nX: y\r\n\r\n",
        "both": head + length + b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
        "preferences": b"POST /v1/renders HTTP/1.1\r\nHost: [::1]:80\r\nPrefer: respond-async, wait=1\r\n"
                       b"Idempotency-Key: \"k\"\r\nFstop-Deadline-Ms: 2000\r\nContent-Type: application/json; "
                       b"charset=utf-8\r\nContent-Length: 2\r\nExpect: 100-continue\r\n\r\n{}",
        "accept": b"GET /v1/renders/a/image?format=exr&number=%33 HTTP/1.1\r\n" + HOST +
                  b"Accept: image/png;q=0.5, image/*;q=0.4, application/json, */*;q=0\r\n"
                  b"Authorization: Bearer 0123456789abcdef\r\nIf-None-Match: W/\"a\", \"b\"\r\n"
                  b"traceparent: 00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01\r\n\r\n",
        "signed": b"GET /v1/renders/a?expires=9999999999&signature=" + b"0" * 64 + b" HTTP/1.1\r\n" + HOST + b"\r\n",
    }
    return {name: b"\x03" + wire for name, wire in wires.items()}


def path() -> dict[str, bytes]:
    paths = ["", "index.html", "assets/a.js", "assets/a%20b.css", "%2e%2e/secret", "..%2fsecret", "link", "up/secret",
             ".env", ".git/config", "a%5cb", "v1/scenes/a", "v1/renders/a/outputs/depth", "livez/", "assets//a.js",
             "%00", "%c0%ae", "assets"]
    return {f"path-{number:02}": text.encode() for number, text in enumerate(paths)}


def request() -> dict[str, bytes]:
    contract = json.loads((ROOT / "api/openapi.json").read_text())
    inputs = {"scene": b"\x01" + json.dumps(SCENE).encode()}
    for target in ("/v1/renders", "/v1/optics", "/v1/psf", "/v1/charts", "/v1/composites"):
        body = contract["paths"][target]["post"]["requestBody"]["content"]["application/json"]["example"]
        inputs[target.rsplit("/", 1)[1]] = b"\x00" + json.dumps(body).encode()
    for file in sorted((ROOT / "api/examples").glob("*.json")):
        inputs[f"example-{file.stem}"] = b"\x00" + file.read_bytes()
    inputs["everything"] = b"\x00" + json.dumps({
        "scene": SCENE,
        "camera": {"pinhole": {"image_distance_mm": 50, "diameter_mm": "optimal", "criterion": "mtf50"},
                   "position_m": [0, 0, 1], "look_at_m": [0, 0, -1], "up": [0, 1, 0], "sensor_mm": [36, 24],
                   "wavelength_nm": 550, "spectrum": "monochromatic", "shutter_s": 0.01, "exposure": {"iso": 100}},
        "image": {"width": 3, "height": 2, "format": "exr", "precision": "half"},
        "quality": {"max_error": 0.02, "max_time_ms": 1000, "method": "auto", "samples": None},
        "effects": {"motion": "on", "falloff": "off"}, "outputs": ["color", "depth"], "seed": 4294967295}).encode()
    return inputs


def glb(document: dict, binary: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def triangle() -> tuple[dict, bytes]:
    positions = struct.pack("<9f", 0, 0, -1, 1, 0, -1, 0, 1, -1)
    indices = struct.pack("<3H", 0, 1, 2) + b"\0\0"
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1, 2], "translation": [0, 0, -1], "rotation": [0, 0, 0, 1]},
                  {"camera": 0, "scale": [1, 2, 1]},
                  {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "spot", "color": [1, 1, 1], "intensity": 5, "spot": {"outerConeAngle": 0.5}}]}},
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1]}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, -1], "max": [1, 1, -1]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": 44}],
    }
    return document, positions + indices


def embedded_gltf() -> bytes:
    import base64
    document, binary = triangle()
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
    return json.dumps(document).encode()


def ply(form: str) -> bytes:
    head = (f"ply\nformat {form} 1.0\ncomment c\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
            "property float u\nproperty float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n")
    corners = [(0, 0, -1, 0, 0), (1, 0, -1, 1, 0), (0, 1, -1, 0, 1)]
    if form == "ascii":
        return head.encode() + "".join(" ".join(map(str, c)) + "\n" for c in corners).encode() + b"3 0 1 2\n"
    order = "<" if form == "binary_little_endian" else ">"
    return head.encode() + b"".join(struct.pack(order + "5f", *c) for c in corners) + struct.pack(order + "B3i", 3, 0, 1, 2)


def mesh() -> dict[str, bytes]:
    return {"glb": b"\x00" + glb(*triangle()), "gltf": b"\x01" + embedded_gltf(),
            "ply-ascii": b"\x02" + ply("ascii"), "ply-little": b"\x02" + ply("binary_little_endian"),
            "ply-big": b"\x02" + ply("binary_big_endian"), "obj": b"\x03" + TRIANGLE_OBJ}


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width: int, height: int, depth: int, color: int, rows: bytes, interlaced: int = 0, more: bytes = b"") -> bytes:
    head = struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, interlaced)
    return (b"\x89PNG\r\n\x1a\n" + png_chunk(b"IHDR", head) + more + png_chunk(b"IDAT", zlib.compress(rows))
            + png_chunk(b"IEND", b""))


def jpeg() -> bytes:
    """8 x 8 pixels of grey: one code of one bit for each of the two tables, so all zeros."""
    def segment(mark: int, data: bytes) -> bytes:
        return b"\xff" + bytes([mark]) + struct.pack(">H", len(data) + 2) + data
    one_code = b"\x01" + b"\0" * 15 + b"\0"
    return (b"\xff\xd8" + segment(0xE0, b"JFIF\0\x01\x01\0\0\x01\0\x01\0\0") + segment(0xFE, b"comment")
            + segment(0xDB, b"\0" + b"\x01" * 64) + segment(0xC0, b"\x08\0\x08\0\x08\x01\x01\x11\0")
            + segment(0xC4, b"\0" + one_code) + segment(0xC4, b"\x10" + one_code)
            + segment(0xDA, b"\x01\x01\0\0\x3f\0") + b"\x3f\xff\xd9")


def exr(compression: int) -> bytes:
    """2 x 2 pixels of half B, G, R; a block that would not shrink is stored as it is."""
    def attribute(name: bytes, kind: bytes, data: bytes) -> bytes:
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data
    channels = b"".join(c + b"\0" + struct.pack("<IBxxxII", 1, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, 1, 1)
    head = (struct.pack("<II", 20000630, 2) + attribute(b"channels", b"chlist", channels)
            + attribute(b"compression", b"compression", bytes([compression]))
            + attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window)
            + attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
            + attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0))
            + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    rows = 16 if compression == 3 else 1
    blocks = [struct.pack("<ii", y, 12 * min(rows, 2)) + struct.pack("<e", 0.5) * 6 * min(rows, 2) for y in range(0, 2, rows)]
    offsets, at = b"", len(head) + 8 * len(blocks)
    for block in blocks:
        offsets += struct.pack("<Q", at)
        at += len(block)
    return head + offsets + b"".join(blocks)


def image() -> dict[str, bytes]:
    files = {
        "grey": png(2, 2, 8, 0, b"\0\x01\x02\1\x03\x04"),
        "alpha": png(2, 1, 8, 6, b"\4" + bytes(range(8)), more=png_chunk(b"tEXt", b"k\0v")),
        "rgb16": png(1, 2, 16, 2, (b"\2" + bytes(6)) * 2),
        "palette": png(4, 1, 2, 3, b"\0\x1b", more=png_chunk(b"PLTE", bytes(12)) + png_chunk(b"tRNS", b"\0")),
        "interlaced": png(3, 3, 8, 0, b"\0\1\0\2\0\3\4\0\5\0\6\0\7\7\7", interlaced=1),
        "jpeg": jpeg(), "exr-plain": exr(0), "exr-zips": exr(2), "exr-zip": exr(3),
    }
    return {name: bytes([number % 2]) + data for number, (name, data) in enumerate(files.items())}


def zipped(files: dict[str, bytes], method: int) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as archive:
        for name, data in files.items():
            archive.writestr(zipfile.ZipInfo(name), data, method)
    return out.getvalue()


def packed(reply: bytes, files: dict[str, bytes]) -> bytes:
    text = b"%d\n" % len(reply) + reply + b"%d\n" % len(files)
    for name, data in files.items():
        text += b"%d\n" % len(name) + name.encode() + b"%d\n" % len(data) + data
    return text


def upload() -> dict[str, bytes]:
    scene = json.dumps(SCENE).encode()
    files = {"scene.json": scene, "card.png": image()["grey"][1:], "m.obj": TRIANGLE_OBJ, "more/unused.txt": b"x"}
    problem = {"type": "/problems/bad-scene", "title": "t", "status": 422, "detail": "d",
               "errors": [{"pointer": "#/objects", "detail": "d"}]}
    return {"zip-stored": b"\x00" + zipped(files, zipfile.ZIP_STORED),
            "zip-deflated": b"\x00" + zipped(files, zipfile.ZIP_DEFLATED),
            "glb": b"\x00" + glb(*triangle()), "answer": b"\x01" + packed(b"{}", {"scene.json": scene}),
            "problem": b"\x02" + json.dumps(problem).encode(), "no-problem": b"\x02{"}


def main() -> None:
    for make in (framing, path, request, mesh, image, upload):
        folder = HERE / "corpus" / make.__name__
        folder.mkdir(parents=True, exist_ok=True)
        for name, data in make().items():
            (folder / name).write_bytes(data)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
"""Prints libFuzzer's dictionary of the words that the contract (the argument) and HTTP are made of."""
import json
import sys
from pathlib import Path

HTTP = ["GET ", "POST ", "PUT ", "OPTIONS ", " HTTP/1.1\r\n", " HTTP/1.0\r\n", "Host: ", "Content-Length: ",
        "Content-Type: application/json\r\n", "Transfer-Encoding: chunked\r\n", "Expect: 100-continue\r\n", "Connection: ",
        "Accept: ", "Prefer: ", "Idempotency-Key: ", "Fstop-Deadline-Ms: ", "Origin: ", "traceparent: ", "If-None-Match: ",
        "Authorization: Bearer ", "\r\n\r\n", "0\r\n\r\n", ";q=", "%2e", "%00", "../"]
FORMATS = ["ply\nformat ", "element ", "property ", "end_header\n", "POSITION", "bufferView", "componentType", "children",
           "glTF", "JSON", "BIN\0", "IHDR", "IDAT", "PLTE", "tRNS", "channels", "dataWindow", "PK\3\4", "PK\1\2", "PK\5\6",
           "\xff\xd8", "\xff\xc0", "\xff\xda", "1e999", "-0", "null", "[[[[", "{\"", "\":", "\\u"]


def words(value) -> set[str]:
    """The members' names and the words of closed sets, anywhere in `value`."""
    found = set()
    if isinstance(value, dict):
        found.update(f'"{name}"' for name in value.get("properties", {}))
        found.update(f'"{word}"' for word in value.get("enum", []) if isinstance(word, str))
        value = value.values()
    elif not isinstance(value, list):
        return found
    for each in value:
        found |= words(each)
    return found


def escaped(text: str) -> str:
    return "".join(c if c.isascii() and c.isprintable() and c not in '"\\' else f"\\x{ord(c):02x}" for c in text)


for word in HTTP + FORMATS + sorted(words(json.loads(Path(sys.argv[1]).read_text())["components"]["schemas"])):
    print(f'"{escaped(word)}"')

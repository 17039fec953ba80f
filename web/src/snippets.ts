/// The page's request as commands for others to run. They wait for the picture, where the server
/// would make a job of a long render.
import type { RenderRequest } from "./contract.ts";

/// For a POSIX shell.
export function curl_command(base: string, request: RenderRequest): string {
  const body = JSON.stringify(request).replaceAll("'", "'\\''");
  const address = new URL("v1/renders", base).href;
  return `curl -s -H 'Content-Type: application/json' -H 'Prefer: wait=600' -d '${body}' ${address} -o picture.png`;
}

/// For Python 3 without further packages.
export function python_program(base: string, request: RenderRequest): string {
  const body = JSON.stringify(JSON.stringify(request, null, 2)).replaceAll("\\n", "\n");
  const text = body.slice(1, -1).replaceAll('\\"', '"');
  return `import json
import urllib.request

request = json.loads(r"""${text}""")
call = urllib.request.Request(
    "${new URL("v1/renders", base).href}",
    json.dumps(request).encode(),
    {"Content-Type": "application/json", "Prefer": "wait=600"},
)
with urllib.request.urlopen(call) as reply, open("picture.png", "wb") as file:
    file.write(reply.read())
    print(reply.headers["Fstop-Method"], reply.headers["Fstop-Error"])
`;
}

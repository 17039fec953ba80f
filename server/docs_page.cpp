#include "server/docs_page.h"

namespace fstop::server {

std::string_view docs_page() {
  return R"(<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width">
<title>fstop: the contract</title>
<link rel="stylesheet" href="/docs/docs.css">
<script type="module" src="/docs/docs.js"></script>
<h1>fstop</h1>
<p id="about">The contract is read from <a href="/openapi.json">/openapi.json</a>.</p>
<nav id="index" aria-label="Calls"></nav>
<main id="calls"></main>
<h2>Schemas</h2>
<section id="schemas"></section>
</html>
)";
}

std::string_view docs_style() {
  return R"(body { max-width: 62rem; margin: 0 auto; padding: 1rem; font: 1rem/1.5 system-ui, sans-serif; }
@media (prefers-color-scheme: dark) { body { background: #14181b; color: #e6e9eb; } a { color: #8cc4ff; } }
h2 { margin-top: 2.5rem; border-top: 1px solid #8886; padding-top: 1rem; }
h3 code, nav code { font-size: 0.95rem; }
.verb { display: inline-block; min-width: 4.5rem; font-weight: 700; }
pre { overflow-x: auto; padding: 0.75rem; background: #8882; border-radius: 4px; }
nav ul { list-style: none; padding: 0; }
table { border-collapse: collapse; width: 100%; }
td, th { text-align: left; vertical-align: top; padding: 0.25rem 0.75rem 0.25rem 0; border-bottom: 1px solid #8884; }
)";
}

std::string_view docs_script() {
  return R"(const contract = await (await fetch("/openapi.json")).json();

function element(name, text, ...children) {
  const made = document.createElement(name);
  if (text) made.textContent = text;
  made.append(...children);
  return made;
}
const resolved = (value) =>
  value?.$ref ? value.$ref.slice(2).split("/").reduce((at, step) => at[step], contract) : value;
function schema_name(schema) {
  if (!schema) return "";
  if (schema.$ref) return schema.$ref.split("/").at(-1);
  const any = schema.oneOf ?? schema.anyOf;
  if (any) return any.map(schema_name).join(" or ");
  if (schema.type === "array") return `list of ${schema_name(schema.items) || "values"}`;
  const type = [schema.type ?? (schema.enum ? "one of" : "value")].flat().join(" or ");
  const words = schema.enum ? " " + schema.enum.map((word) => JSON.stringify(word)).join(", ") : "";
  const ends = [schema.minimum, schema.maximum].some((end) => end !== undefined)
    ? ` ${schema.minimum ?? ""}..${schema.maximum ?? ""}` : "";
  return type + words + ends;
}
function schema_cell(schema) {
  const cell = element("td");
  const name = schema_name(schema);
  if (schema?.$ref) {
    const link = element("a", name);
    link.href = `#schema-${name}`;
    cell.append(link);
  } else cell.textContent = name;
  return cell;
}
function table(heads, rows) {
  const made = element("table", "", element("tr", "", ...heads.map((head) => element("th", head))));
  made.append(...rows.map((cells) => element("tr", "", ...cells)));
  return made;
}
const example = (value) =>
  element("pre", typeof value === "string" ? value : JSON.stringify(value, null, 2));

function call(path, verb, operation) {
  const part = element("section");
  const title = element("h3", "", element("span", verb.toUpperCase()), element("code", path));
  title.id = operation.operationId;
  title.firstChild.className = "verb";
  part.append(title, element("p", operation.summary ?? ""));
  if (operation.description) part.append(element("p", operation.description));
  const parameters = (operation.parameters ?? []).map(resolved);
  if (parameters.length) {
    part.append(table(["parameter", "in", "type", ""], parameters.map((parameter) => [
      element("td", parameter.name), element("td", parameter.in), schema_cell(parameter.schema),
      element("td", parameter.description ?? "")])));
  }
  for (const [type, content] of Object.entries(operation.requestBody?.content ?? {})) {
    part.append(element("h4", `Body: ${type}`), table([""], [[schema_cell(content.schema)]]));
    if (content.example) part.append(example(content.example));
  }
  part.append(element("h4", "Replies"));
  part.append(table(["status", "type", "", ""], Object.entries(operation.responses).flatMap(
    ([status, reference]) => {
      const reply = resolved(reference);
      const types = Object.entries(reply.content ?? { "": {} });
      return types.map(([type, content]) => [element("td", status), element("td", type),
        schema_cell(content.schema), element("td", reply.description)]);
    })));
  for (const reference of Object.values(operation.responses)) {
    for (const content of Object.values(resolved(reference).content ?? {}))
      if (content.example) part.append(example(content.example));
  }
  return part;
}

document.querySelector("#about").textContent = contract.info.description;
const index = element("ul");
for (const [path, operations] of Object.entries(contract.paths)) {
  for (const [verb, operation] of Object.entries(operations)) {
    const link = element("a", "", element("code", `${verb.toUpperCase()} ${path}`));
    link.href = `#${operation.operationId}`;
    index.append(element("li", "", link, ` ${operation.summary ?? ""}`));
    document.querySelector("#calls").append(call(path, verb, operation));
  }
}
document.querySelector("#index").append(index);
for (const [name, schema] of Object.entries(contract.components.schemas)) {
  const title = element("h3", name);
  title.id = `schema-${name}`;
  const part = element("section", "", title, element("p", schema.description ?? schema_name(schema)));
  const required = new Set(schema.required ?? []);
  const members = Object.entries(schema.properties ?? {});
  if (members.length) {
    part.append(table(["member", "type", ""], members.map(([key, member]) => [
      element("td", key + (required.has(key) ? " *" : "")), schema_cell(member),
      element("td", member.description ?? "")])));
  }
  document.querySelector("#schemas").append(part);
}
)";
}

}  // namespace fstop::server

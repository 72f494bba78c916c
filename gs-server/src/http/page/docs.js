// The reference of the API, drawn from /api/v1/openapi.json.

/** An element with attributes and children; strings become text, never markup. */
const el = (name, attributes, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes ?? {})) made.setAttribute(key, value);
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
};

const nameOf = (reference) => reference.split("/").pop();

/** A schema in a few words, with links to those that have a name. */
const words = (schema) => {
  if (!schema || schema === true) return ["anything"];
  if (schema.$ref) {
    const name = nameOf(schema.$ref);
    return [el("a", { href: `#shape-${name}` }, name)];
  }
  const several = schema.oneOf ?? schema.anyOf ?? schema.allOf;
  if (several) {
    const between = schema.allOf ? " and " : " or ";
    return several.flatMap((one, at) => [at ? between : null, ...words(one)]);
  }
  if (schema.const !== undefined) return [`"${schema.const}"`];
  if (schema.enum) return [schema.enum.map((one) => JSON.stringify(one)).join(" or ")];
  const types = [schema.type ?? "anything"].flat();
  return types.flatMap((type, at) => {
    const lead = at ? [" or "] : [];
    if (type === "array") return [...lead, "list of ", ...words(schema.items)];
    if (type === "object" && schema.properties) return [...lead, "object"];
    return [...lead, schema.format && type !== "null" ? `${type} (${schema.format})` : type];
  });
};

const range = ({ minimum, maximum }) => {
  if (minimum === undefined && maximum === undefined) return "";
  return ` ${minimum ?? "…"} to ${maximum ?? "…"}`;
};

const row = (name, what, about, must) =>
  el("tr", {}, el("th", { scope: "row" }, name, must ? " *" : ""), el("td", {}, ...what), el("td", {}, about ?? ""));

const fields = (schema) => {
  const rows = [];
  for (const part of schema.allOf ?? [schema]) {
    if (part.$ref) rows.push(row("…", words(part), "all of its fields"));
    for (const [name, field] of Object.entries(part.properties ?? {})) {
      rows.push(row(name, [...words(field), range(field)], field.description, (part.required ?? []).includes(name)));
    }
  }
  return rows.length ? [el("table", {}, el("tbody", {}, ...rows))] : [];
};

const operation = (path, method, of, document_) => {
  const parameters = (of.parameters ?? []).map((given) => {
    const one = given.$ref ? document_.components.parameters[nameOf(given.$ref)] : given;
    return row(one.name, [...words(one.schema), range(one.schema), ` (${one.in})`], one.description, one.required);
  });
  const answers = Object.entries(of.responses ?? {}).map(([status, answer]) => {
    const shapes = Object.entries(answer.content ?? {}).flatMap(([type, content]) => [
      `${type}: `,
      ...words(content.schema),
    ]);
    return row(status, shapes, answer.description);
  });
  const body = Object.entries(of.requestBody?.content ?? {});
  return el(
    "details",
    { id: of.operationId, class: "operation" },
    el("summary", {}, el("b", { class: `method ${method}` }, method.toUpperCase()), " ", el("code", {}, path), " ", of.summary ?? ""),
    of.description ? el("p", {}, of.description) : null,
    of.security?.length ? el("p", {}, "Needs a token.") : null,
    parameters.length ? el("h4", {}, "Parameters") : null,
    parameters.length ? el("table", {}, el("tbody", {}, ...parameters)) : null,
    ...body.flatMap(([type, content]) => [el("h4", {}, "Body"), el("p", {}, `${type}: `, ...words(content.schema))]),
    el("h4", {}, "Answers"),
    el("table", {}, el("tbody", {}, ...answers)),
  );
};

const draw = (document_) => {
  const at = (id) => document.getElementById(id);
  at("title").textContent = `${document_.info.title}: API ${document_.info.version}`;
  at("about").textContent = document_.info.description ?? "";
  for (const tag of document_.tags ?? []) {
    at("tags").append(el("a", { href: `#tag-${tag.name}` }, tag.name), " ");
    const section = el("section", { id: `tag-${tag.name}` }, el("h2", {}, tag.name), el("p", {}, tag.description ?? ""));
    for (const [path, methods] of Object.entries(document_.paths)) {
      for (const [method, of] of Object.entries(methods)) {
        if (of.tags?.includes(tag.name)) section.append(operation(path, method, of, document_));
      }
    }
    at("operations").append(section);
  }
  at("shapes").append(el("h2", {}, "Shapes"), el("p", {}, "* always there (answers) or required (requests)"));
  for (const [name, schema] of Object.entries(document_.components.schemas)) {
    at("shapes").append(
      el(
        "details",
        { id: `shape-${name}` },
        el("summary", {}, el("code", {}, name)),
        el("p", {}, schema.description ?? ""),
        schema.properties || schema.allOf ? null : el("p", {}, ...words(schema)),
        ...(schema.oneOf ?? [schema]).flatMap(fields),
      ),
    );
  }
  const problems = (document_["x-problem-types"] ?? []).map((kind) => {
    const line = row(kind.type, [String(kind.status)], kind.title);
    line.id = `problem-${kind.type.split(":").pop()}`;
    return line;
  });
  at("problems").append(el("h2", {}, "Problems"), el("table", {}, el("tbody", {}, ...problems)));
};

/** Opens what the address names. */
const follow = () => {
  const wanted = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (wanted instanceof HTMLDetailsElement) wanted.open = true;
  wanted?.scrollIntoView();
};

const find = (text) => {
  const parts = text.toLowerCase().split(/\s+/);
  for (const one of document.querySelectorAll("details")) {
    const summary = one.querySelector("summary").textContent.toLowerCase();
    one.hidden = !parts.every((part) => summary.includes(part));
  }
};

const answer = await fetch("/api/v1/openapi.json", { headers: { accept: "application/json" } });
draw(await answer.json());
follow();
addEventListener("hashchange", follow);
document.getElementById("find").addEventListener("input", (event) => find(event.target.value));

// What is recorded is what the service of today describes in its OpenAPI document.

import { readdirSync } from "node:fs";
import { expect, test } from "./fixtures.mjs";
import { changed, recorded } from "./recorded.mjs";

/** Where `value` is not as `schema` of `document` says. A schema that is a part of another one need not describe every member. */
function faults(document, schema, value, path, isPart = false) {
  const within = (inner, item, key = "", part = false) => faults(document, inner, item, `${path}${key}`, part);
  if (schema.$ref) return within(schema.$ref.split("/").slice(1).reduce((part, key) => part[key], document), value, "", isPart);
  const { properties, additionalProperties, required = [], allOf = [] } = schema, choices = schema.oneOf ?? schema.anyOf;
  const chosen = choices?.map((choice) => within(choice, value, "", Boolean(properties) || isPart)).sort((a, b) => a.length - b.length)[0] ?? [];
  const type = value === null ? "null" : Array.isArray(value) ? "array" : typeof value, types = [schema.type ?? type].flat().map((name) => (name === "integer" ? "number" : name));
  if (!types.includes(type) || (schema.enum && !schema.enum.includes(value))) return [`${path}: ${JSON.stringify(value)}`];
  if (type === "array") return value.flatMap((item) => within(schema.items ?? {}, item, "/*"));
  if (type !== "object") return chosen;
  const members = Object.entries(value).flatMap(([key, item]) => {
    const inner = properties?.[key] ?? (typeof additionalProperties === "object" ? additionalProperties : undefined);
    return inner ? within(inner, item, `/${key}`) : properties && !isPart ? [`${path}/${key}: is not described`] : [];
  });
  return [...chosen, ...allOf.flatMap((part) => within(part, value, "", true)), ...required.filter((key) => !(key in value)).map((key) => `${path}/${key}: is not there`), ...members];
}

test("every recorded answer and event is as the service describes it", async ({ service }) => {
  const document = await service.get("/openapi.json"), described = (name, value) => faults(document, document.components.schemas[name], value, name);
  for (const file of readdirSync(new URL("recordings", import.meta.url))) {
    const { opening, frames } = recorded(file.replace(".ndjson", ""));
    let { mission } = opening;
    for (const reference of Object.values(opening.references ?? [opening.reference])) expect(described("CurrentReference", reference)).toEqual([]);
    for (const frame of [opening, ...opening.events, ...frames]) {
      if (frame.mission) mission = frame === opening ? mission : changed(mission, frame.mission);
      const found = [...described("Mission", frame.answer ?? mission), ...frame.scene ? described("Scene", frame.scene) : [], ...frame.event ? described("Event", frame.data) : [], ...frame.order ? described("Setting", frame.order.body) : []];
      expect(found, `${file}, ${frame.at} s`).toEqual([]);
    }
  }
});

// Prints the public items of a crate, one a line and sorted, from what rustdoc writes as JSON: node public_api.mjs FILE.
import { readFileSync } from "node:fs";

const { index, paths, root } = JSON.parse(readFileSync(process.argv[2], "utf8"));
const lines = new Set();
// An item that several paths lead to is listed in full under the first of them.
const listed = new Map();

const only = (object) => Object.entries(object)[0];
const list = (items, render) => items.map(render).join(", ");

function args(of) {
  if (!of?.angle_bracketed) return of?.parenthesized ? `(${list(of.parenthesized.inputs, type)})` : "";
  const { args: given, constraints } = of.angle_bracketed;
  const one = (arg) => (arg === "infer" ? "_" : arg.type ? type(arg.type) : arg.lifetime ?? arg.const.expr);
  const bound = ({ name, binding }) => `${name}${binding.equality ? ` = ${type(binding.equality.type)}` : ""}`;
  const all = [...given.map(one), ...constraints.map(bound)];
  return all.length ? `<${all.join(", ")}>` : "";
}

const path = (of) => of.path.split("::").at(-1) + args(of.args);

function bounds(of) {
  return of.map((bound) => (bound.trait_bound ? path(bound.trait_bound.trait) : bound.outlives ?? "use")).join(" + ");
}

function type(of) {
  if (of === null) return "()";
  if (of === "infer") return "_";
  const [kind, inner] = only(of);
  switch (kind) {
    case "primitive":
    case "generic": return inner;
    case "resolved_path": return path(inner);
    case "tuple": return `(${list(inner, type)})`;
    case "slice": return `[${type(inner)}]`;
    case "array": return `[${type(inner.type)}; ${inner.len}]`;
    case "borrowed_ref":
      return `&${inner.lifetime ? `${inner.lifetime} ` : ""}${inner.is_mutable ? "mut " : ""}${type(inner.type)}`;
    case "impl_trait": return `impl ${bounds(inner)}`;
    case "dyn_trait": return `dyn ${inner.traits.map((bound) => path(bound.trait)).join(" + ")}`;
    case "qualified_path": return `<${type(inner.self_type)} as ${inner.trait?.path ?? "_"}>::${inner.name}`;
    case "function_pointer": return `fn(${list(inner.sig.inputs, ([, input]) => type(input))})`;
    default: throw new Error(`a type of kind ${kind}`);
  }
}

function generics(of) {
  const own = of.params.filter((param) => !param.kind.type?.is_synthetic);
  const one = ({ name, kind }) => name + (kind.type?.bounds.length ? `: ${bounds(kind.type.bounds)}` : "");
  const where = of.where_predicates.map(({ bound_predicate: predicate }) =>
    predicate ? `${type(predicate.type)}: ${bounds(predicate.bounds)}` : "");
  return [own.length ? `<${list(own, one)}>` : "", where.length ? ` where ${where.join(", ")}` : ""];
}

function signature(name, { sig, generics: of, header }) {
  const [params, where] = generics(of);
  const inputs = list(sig.inputs, ([label, input]) => `${label}: ${type(input)}`);
  const output = sig.output ? ` -> ${type(sig.output)}` : "";
  return `${header.is_const ? "const " : ""}fn ${name}${params}(${inputs})${output}${where}`;
}

// Marks that change what callers may write.
const marks = (item) =>
  item.attrs.some((mark) => JSON.stringify(mark).includes("non_exhaustive")) ? "#[non_exhaustive] " : "";

function fields(ids, name) {
  for (const id of ids) {
    const field = index[id];
    if (field) lines.add(`${name}.${field.name}: ${type(field.inner.struct_field)}`);
  }
}

function shape(kind, name) {
  if (kind.struct || kind.plain) fields((kind.struct ?? kind.plain).fields, name);
  if (kind.tuple) fields(kind.tuple.filter((id) => id !== null), name);
}

function impls(ids, name) {
  for (const { inner: { impl: of } } of ids.map((id) => index[id])) {
    if (of.is_synthetic || of.blanket_impl) continue;
    if (of.trait) lines.add(`impl ${path(of.trait)} for ${name}`);
    else of.items.forEach((id) => item(index[id], `${name}::${index[id].name}`));
  }
}

function item(of, name) {
  const [kind, inner] = only(of.inner);
  if (kind === "use") {
    const target = index[inner.id];
    const at = name.slice(0, name.lastIndexOf("::") + 2) + inner.name;
    if (inner.is_glob) return target.inner.module.items.forEach((id) => item(index[id], at + index[id].name));
    if (!target) return lines.add(`use ${inner.source} as ${at}`);
    return item(target, at);
  }
  const known = listed.get(of.id);
  if (known !== undefined && known !== name) return lines.add(`use ${known} as ${name}`);
  listed.set(of.id, name);
  switch (kind) {
    case "module":
      lines.add(`mod ${name}`);
      // Modules first: what a module has is listed there, and the root repeats the common ones.
      return inner.items.map((id) => index[id])
        .sort((a, b) => Boolean(b.inner.module) - Boolean(a.inner.module) || a.id - b.id)
        .forEach((child) => item(child, `${name}::${child.name ?? ""}`));
    case "struct":
      lines.add(`${marks(of)}struct ${name}${generics(inner.generics).join("")}`);
      shape(inner.kind, name);
      return impls(inner.impls, name);
    case "enum":
      lines.add(`${marks(of)}enum ${name}${generics(inner.generics).join("")}`);
      for (const variant of inner.variants.map((id) => index[id])) {
        lines.add(`${marks(variant)}variant ${name}::${variant.name}`);
        shape(variant.inner.variant.kind, `${name}::${variant.name}`);
      }
      return impls(inner.impls, name);
    case "function": return lines.add(signature(name, inner));
    case "constant": return lines.add(`const ${name}: ${type(inner.type)}`);
    case "assoc_const": return lines.add(`const ${name}: ${type(inner.type)}`);
    case "type_alias": return lines.add(`type ${name} = ${type(inner.type)}`);
    case "trait":
      lines.add(`trait ${name}`);
      return inner.items.forEach((id) => item(index[id], `${name}::${index[id].name}`));
    default: throw new Error(`${name} is a ${kind}`);
  }
}

item(index[root], paths[root].path[0]);
const named = (line) => line.slice(line.indexOf("rtfmesh"));
const order = (a, b) => (named(a) < named(b) ? -1 : named(a) > named(b) ? 1 : a < b ? -1 : 1);
console.log([...lines].sort(order).join("\n"));

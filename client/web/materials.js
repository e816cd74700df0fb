// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The materials of a print, and how they are mixed: along a channel, by channels that are shares themselves, or in each
// cell region its own way.
//
//   { method, seed, materials: [{ name, colour }], maps: [{ region, by, at }] }
//
// A map is that of a cell region, or of the whole part where `region` is "". `by` is one of
//   "blend:CHANNEL"  at[i] is the channel's value where all is material i, or null if it isn't mixed in
//   "direct"         at[i] is "channel:NAME", whose values are the shares of material i, or "rest", or "" for none
//   "material:I"     all is material I; only in cell regions

/** The contract takes that many. */
export const most_materials = 8;
const palette = ["#f2c14e", "#2d5d8b", "#b23a48", "#5b8c5a", "#7d5ba6", "#e5e5e5", "#333333", "#e07a3f"];

/** Of "blend:CHANNEL" and "channel:CHANNEL"; the number of "material:I". */
export const channel_of = (text) => text.slice(text.indexOf(":") + 1);
const indices = (list) => list.map((_, i) => i);
const is_blend = (map) => map.by.startsWith("blend:");

/** [value, text] each: what may mix the materials of a mesh. */
export function ways_of(mesh) {
  const channels = mesh.channels.map((c) => [`blend:${c.name}`, c.name]);
  if (channels.length > 0) channels.push(["direct", "the channels themselves"]);
  return (mesh.cell_regions ?? []).length > 0 ? [...channels, ["regions", "cell region"]] : channels;
}

/** Likewise, within a cell region. */
export const ways_of_region = (printing, mesh) => [
  ...printing.materials.map((m, i) => [`material:${i}`, `all ${m.name}`]),
  ...mesh.channels.map((c) => [`blend:${c.name}`, `mixed by ${c.name}`]),
  ...(mesh.channels.length > 0 ? [["direct", "the channels themselves"]] : [])];

/** Which of ways_of() a printing is. */
export const way_of = (printing) => (printing.maps[0].region === "" ? printing.maps[0].by : "regions");

/** Whether a printing, of an address, is one of this mesh. */
export function fits(printing, mesh) {
  const shares = ["", "rest", ...mesh.channels.map((c) => `channel:${c.name}`)];
  const regions = (mesh.cell_regions ?? []).map((r) => r.name);
  if (![printing?.maps, printing?.materials].every((list) => Array.isArray(list) && list.length > 0)) return false;
  const whole = printing.maps.length === 1 && printing.maps[0].region === "";
  if (!whole && printing.maps.map((m) => m.region).join("\n") !== regions.join("\n")) return false;
  const ways = whole ? ways_of(mesh) : ways_of_region(printing, mesh);
  const complete = (map) => Array.isArray(map.at) &&
    (map.by.startsWith("material:") || map.at.length === printing.materials.length);
  return printing.maps.every((map) => ways.some(([way]) => way === map.by && way !== "regions") && complete(map) &&
    (map.by !== "direct" || map.at.every((of) => shares.includes(of))));
}

/** A map from nothing: the materials one after the other along the channel, or channel by channel. */
export function default_map(region, by, materials, mesh) {
  if (by.startsWith("blend:")) {
    const { min_value: low, max_value: high } = mesh.channels.find((c) => c.name === channel_of(by));
    const step = (high > low ? high - low : 1) / Math.max(1, materials.length - 1);
    // The channels are floats: of 0.2 these digits are left.
    return { region, by, at: indices(materials).map((i) => Number((low + i * step).toPrecision(7))) };
  }
  const share = (i) => (i < mesh.channels.length ? `channel:${mesh.channels[i].name}` : "");
  const at = by === "direct" ? indices(materials).map((i) => (i === mesh.channels.length ? "rest" : share(i))) : [];
  return { region, by, at };
}

function default_names(by, mesh) {
  if (by.startsWith("blend:")) return ["soft", "hard"];
  const own = by === "direct" ? mesh.channels : mesh.cell_regions;
  // Names of materials have 64 bytes at most.
  const fit = (name, i) => (new TextEncoder().encode(name).length > 64 ? `material ${i + 1}` : name);
  const names = own.slice(0, most_materials).map((each, i) => fit(each.name, i));
  return by === "direct" && names.length === 1 ? [...names, names[0] === "rest" ? "other" : "rest"] : names;
}

/** What a mesh is printed with until somebody says more. `by`: one of ways_of(). */
export function default_printing(by, mesh) {
  const materials = default_names(by, mesh).map((name, i) => ({ name, colour: palette[i] }));
  const maps = by === "regions" ?
    mesh.cell_regions.map((r, i) => default_map(r.name, `material:${i % materials.length}`, materials, mesh)) :
    [default_map("", by, materials, mesh)];
  return { method: "HALFTONE_METHOD_BLUE_NOISE", seed: 0, materials, maps };
}

function map_message(map, materials) {
  const names = materials.map((m) => m.name);
  if (map.by === "direct") {
    const of = (i) => ({ channel: channel_of(map.at[i]), material: names[i] }), rest = map.at.indexOf("rest");
    const shares = indices(map.at).filter((i) => map.at[i].startsWith("channel:")).map(of);
    return { direct: { shares, rest_material: rest < 0 ? "" : names[rest] } };
  }
  if (!is_blend(map)) return { material: names[Number(channel_of(map.by))] };
  const mixed = indices(map.at).filter((i) => map.at[i] !== null).sort((i, j) => map.at[i] - map.at[j]);
  const stops = mixed.map((i) => ({ value: map.at[i], material: names[i] }));
  return { blend: { channel: channel_of(map.by), stops } };
}

/** The contract's Printing. */
export function printing_message(printing) {
  const { materials, maps, method, seed } = printing, whole = maps.find((map) => map.region === "");
  return {
    materials: materials.map((m) => ({ name: m.name, rgba: Number.parseInt(m.colour.slice(1) + "ff", 16) })),
    ...(whole ? { map: map_message(whole, materials) } : {}),
    cell_region_maps: maps.filter((map) => map.region !== "").map((map) =>
      ({ cell_region: map.region, map: map_message(map, materials) })),
    halftone: { method, seed },
  };
}

/** How few materials there may be. */
export const fewest_materials = (printing) => (printing.maps[0].region === "" && is_blend(printing.maps[0]) ? 2 : 1);

/** One more. Along the channel of the whole part it is beyond the last; regions don't have it yet. */
export function add_material(printing) {
  const { materials, maps } = printing, names = materials.map((m) => m.name), taken = materials.map((m) => m.colour);
  let number = materials.length + 1;
  while (names.includes(`material ${number}`)) ++number;
  materials.push({ name: `material ${number}`, colour: palette.find((c) => !taken.includes(c)) ?? "#808080" });
  for (const map of maps) {
    const [last, before] = map.at.filter((x) => x !== null).sort((a, b) => b - a);
    if (map.by === "direct") map.at.push(map.at.includes("rest") ? "" : "rest");
    else if (is_blend(map)) map.at.push(map.region === "" ? (last ?? 0) + ((last - before) || 1) : null);
  }
}

/** The regions that were all of it become all of the first one. */
export function remove_material(printing, i) {
  printing.materials.splice(i, 1);
  for (const map of printing.maps) {
    map.at.splice(i, 1);
    if (!map.by.startsWith("material:")) continue;
    const of = Number(channel_of(map.by));
    map.by = `material:${of === i ? 0 : of - (of > i)}`;
  }
}

/** One material at most takes the rest. */
export function set_share(map, i, share) {
  if (share === "rest") map.at = map.at.map((of) => (of === "rest" ? "" : of));
  map.at[i] = share;
}

/** Channels that are used as shares, and don't go from 0 to 1: { name, min_value, max_value }. */
export const channels_beyond_shares = (printing, mesh) => mesh.channels.filter((c) =>
  (c.min_value < -1e-6 || c.max_value > 1 + 1e-6) &&
  printing.maps.some((map) => map.by === "direct" && map.at.includes(`channel:${c.name}`)));

// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The materials of a print: which channel mixes them, and at which of its values each is pure.

const by_value = (a, b) => a.value - b.value;

/** Two materials, pure at the ends of a channel's range. */
export function default_printing(channel) {
  if (!channel) return { channel: "", method: "HALFTONE_METHOD_BLUE_NOISE", seed: 0, materials: [] };
  // The channels are floats: of 0.2 these digits are left.
  const [low, high] = [channel.min_value, channel.max_value].map((x) => Number(x.toPrecision(7)));
  return { channel: channel.name, method: "HALFTONE_METHOD_BLUE_NOISE", seed: 0, materials: [
    { name: "soft", colour: "#f2c14e", value: low },
    { name: "hard", colour: "#2d5d8b", value: high > low ? high : low + 1 }] };
}

/** The contract's Printing. */
export function printing_message(printing) {
  const sorted = [...printing.materials].sort(by_value);
  return {
    materials: printing.materials.map((m) => ({ name: m.name, rgba: Number.parseInt(m.colour.slice(1) + "ff", 16) })),
    map: { blend: { channel: printing.channel, stops: sorted.map((m) => ({ value: m.value, material: m.name })) } },
    halftone: { method: printing.method, seed: printing.seed },
  };
}

function input(type, label, value, change) {
  const made = Object.assign(document.createElement("input"), { type, value, required: true });
  if (type === "number") made.step = "any";
  made.setAttribute("aria-label", label);
  made.onchange = () => made.reportValidity() && change(made.value);
  return made;
}

/** Shows the materials in a table's body; calls changed() when one is another one. */
export function list_materials(body, printing, changed) {
  const redo = () => {
    list_materials(body, printing, changed);
    changed();
  };
  body.replaceChildren(...printing.materials.map((material, i) => {
    const remove = Object.assign(document.createElement("button"), { type: "button", textContent: "✕" });
    remove.setAttribute("aria-label", `Remove ${material.name}`);
    remove.disabled = printing.materials.length <= 2;
    remove.onclick = () => {
      printing.materials.splice(i, 1);
      redo();
    };
    const set = (key, of = String) => (value) => {
      material[key] = of(value);
      changed();
    };
    const name = input("text", `Name of material ${i + 1}`, material.name, set("name"));
    name.maxLength = 64;
    const cells = [input("color", `Colour of ${material.name}`, material.colour, set("colour")), name,
      input("number", `Value of the channel where all is ${material.name}`, material.value, set("value", Number)), remove];
    const row = document.createElement("tr");
    row.append(...cells.map((cell) => {
      const place = document.createElement("td");
      place.append(cell);
      return place;
    }));
    return row;
  }));
}

/** The contract takes that many. */
export const most_materials = 8;

/** One more, beyond the last. */
export function add_material(printing) {
  const colours = ["#f2c14e", "#2d5d8b", "#b23a48", "#5b8c5a", "#7d5ba6", "#e5e5e5", "#333333", "#e07a3f"];
  const taken = printing.materials.map((m) => m.colour), names = printing.materials.map((m) => m.name);
  const [last, before] = [...printing.materials].sort((a, b) => -by_value(a, b));
  let number = printing.materials.length + 1;
  while (names.includes(`material ${number}`)) ++number;
  printing.materials.push({ name: `material ${number}`, colour: colours.find((c) => !taken.includes(c)) ?? "#808080",
    value: last.value + (last.value - before.value || 1) });
}

// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The page's form of a printing: a table of the materials, with how the whole part mixes them beside each, or below a
// form for each cell region.
import {
  add_material, channel_of, channels_beyond_shares, default_map, fewest_materials, most_materials, remove_material,
  set_share, way_of, ways_of_region,
} from "./materials.js";
import { show } from "./values.js";

const $ = (id) => document.getElementById(id);
const make = (tag, values = {}) => Object.assign(document.createElement(tag), values);

export function fill(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => new Option(text, value, false, value === chosen)));
  select.value = chosen;
}

function row(...cells) {
  const made = make("tr");
  made.append(...cells.map((cell) => {
    const place = make("td");
    place.append(cell);
    return place;
  }));
  return made;
}

/** Of what part_of() says. */
const heading = (map) => (map.by === "direct" ? "share is" : "all at");

/** Shows a printing of a mesh. `changed()` is called when it has become another one. */
export class MaterialsForm {
  constructor(changed) {
    this.changed = changed;
    $("add-material").onclick = () => this.redo(() => add_material(this.printing), "add-material");
    $("method").onchange = () => this.set(() => { this.printing.method = $("method").value; });
    $("seed").onchange = () => {
      if ($("seed").reportValidity()) this.set(() => { this.printing.seed = Number($("seed").value); });
    };
  }

  show(printing, mesh) {
    Object.assign(this, { printing, mesh, labels: [] });
    $("mixed-by").value = way_of(printing);
    $("method").value = printing.method;
    $("seed").value = printing.seed;
    const [first] = printing.maps, whole = first.region === "" ? first : null;
    $("mixed-head").hidden = !whole;
    if (whole) $("mixed-head").textContent = heading(whole);
    $("materials").replaceChildren(...printing.materials.map((_, i) => this.material(i, whole)));
    $("region-maps").replaceChildren(...(whole ? [] : printing.maps.map((map, i) => this.region(map, i))));
    $("add-material").disabled = printing.materials.length >= most_materials;
    this.relabel();
  }

  /** Another printing, with the same inputs. */
  set(change) {
    change();
    this.relabel();
    this.changed();
  }

  /** Another printing, with other inputs; the one with this id has the focus then, or the last material's if that one is
   *  of no use any more: somebody with a keyboard stays where they are. */
  redo(change, focus) {
    change();
    this.show(this.printing, this.mesh);
    const wanted = $(focus);
    (wanted.disabled ? $("materials").querySelector("tr:last-child button") : wanted).focus();
    this.changed();
  }

  /** Names in labels and lists are those of now. */
  relabel() {
    for (const label of this.labels) label();
    const beyond = channels_beyond_shares(this.printing, this.mesh);
    $("mix-note").hidden = beyond.length === 0;
    $("mix-note").textContent = "Shares go from 0 to 1. " +
      beyond.map((c) => `${c.name} goes from ${show(c.min_value)} to ${show(c.max_value)}.`).join(" ");
  }

  /** `label`: what makes the input's name from the present names of the materials. */
  labelled(element, label) {
    this.labels.push(() => element.setAttribute("aria-label", label()));
    return element;
  }

  input(values, label, change) {
    const made = make("input", values);
    made.onchange = () => made.reportValidity() && this.set(() => change(made.value));
    return this.labelled(made, label);
  }

  material(i, whole) {
    const { materials } = this.printing, material = materials[i];
    const colour = this.input({ type: "color", value: material.colour }, () => `Colour of ${material.name}`,
      (value) => { material.colour = value; });
    const name = this.input({ type: "text", value: material.name, required: true, maxLength: 64 },
      () => `Name of material ${i + 1}`, (value) => { material.name = value; });
    const remove = make("button", { type: "button", textContent: "✕",
      disabled: materials.length <= fewest_materials(this.printing) });
    remove.onclick = () => this.redo(() => remove_material(this.printing, i), "add-material");
    this.labelled(remove, () => `Remove ${material.name}`);
    return row(colour, name, ...(whole ? [this.part_of(whole, i)] : []), remove);
  }

  /** What a map says of a material: a value of the channel, or which channel is its share. */
  part_of(map, i) {
    const { name } = this.printing.materials[i], of = () => this.printing.materials[i]?.name ?? name;
    if (map.by === "direct") {
      const select = make("select");
      fill(select, [...this.mesh.channels.map((c) => [`channel:${c.name}`, c.name]), ["rest", "the rest"],
        ["", "none"]], map.at[i]);
      select.id = `share-${this.printing.maps.indexOf(map)}-${i}`;
      select.onchange = () => this.redo(() => set_share(map, i, select.value), select.id);
      return this.labelled(select, () => `Share of ${of()}` + (map.region && ` in ${map.region}`));
    }
    return this.input({ type: "number", step: "any", value: map.at[i] ?? "", placeholder: "not used" },
      () => map.region ? `Value of ${channel_of(map.by)} where ${map.region} is all ${of()}` :
        `Value of the channel where all is ${of()}`,
      (value) => { map.at[i] = value === "" ? null : Number(value); });
  }

  region(map, number) {
    const { printing, mesh } = this, made = make("div", { className: "region" });
    const label = make("label", { textContent: map.region }), select = make("select", { id: `region-${number}` });
    select.setAttribute("aria-label", `Materials of ${map.region}`);
    label.append(select);
    made.append(label);
    this.labels.push(() => fill(select, ways_of_region(printing, mesh), map.by));
    select.onchange = () => this.redo(() => Object.assign(map,
      default_map(map.region, select.value, printing.materials, mesh)), select.id);
    if (map.by.startsWith("material:")) return made;
    const table = make("table"), head = make("tr");
    head.append(make("th", { textContent: "Material" }), make("th", { textContent: heading(map) }));
    table.append(head, ...printing.materials.map((material, i) => {
      const name = make("span");
      this.labels.push(() => { name.textContent = material.name; });
      return row(name, this.part_of(map, i));
    }));
    made.append(table);
    return made;
  }
}

/** Creation of elements, and the page's icons. */

export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Partial<HTMLElementTagNameMap[K]> & { class?: string } = {},
  ...children: (Node | string)[]
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  const { class: names, ...rest } = properties;
  if (names) made.className = names;
  Object.assign(made, rest);
  made.append(...children);
  return made;
}

/** A button with a tooltip that includes its key. */
export function button(label: string | Node, title: string, act: () => void, names = ""): HTMLButtonElement {
  const made = element("button", { type: "button", title, class: names, onclick: act }, label);
  if (typeof label !== "string" || label.length < 3) made.setAttribute("aria-label", title);
  return made;
}

/** A row of buttons that acts as radio buttons. */
export function segmented<T extends string>(
  options: readonly { value: T; label: string; title: string }[],
  choose: (value: T) => void,
): { host: HTMLElement; show(value: T, enabled?: (value: T) => boolean): void } {
  const host = element("div", { class: "segmented" });
  host.setAttribute("role", "radiogroup");
  const buttons = options.map(({ value, label, title }) => {
    const made = button(label, title, () => choose(value));
    made.setAttribute("role", "radio");
    made.dataset["value"] = value;
    host.append(made);
    return { value, made };
  });
  return {
    host,
    show(current, enabled) {
      for (const { value, made } of buttons) {
        made.setAttribute("aria-checked", String(value === current));
        made.disabled = enabled ? !enabled(value) : false;
      }
    },
  };
}

/** 3 significant digits, without an exponent between 0.001 and 99,999. */
export function short(value: number): string {
  if (!Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e5)) return value.toExponential(2);
  return String(Number(value.toPrecision(size >= 100 ? 4 : 3)));
}

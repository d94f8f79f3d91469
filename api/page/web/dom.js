// Elements without markup: every text becomes a text node, so that no external name can become an element.

/**
 * @typedef {Node | string | number | null | undefined | false} Child
 * @typedef {{ [name: string]: unknown }} Properties
 */

/**
 * An element with its properties and children. `on…` are listeners; `class`, `aria-…` and whatever is not a property of the
 * element are attributes. Undefined, null and false are left out.
 * @template {keyof HTMLElementTagNameMap} K
 * @param {K} name
 * @param {Properties} [properties]
 * @param {...(Child | Child[])} children
 * @returns {HTMLElementTagNameMap[K]}
 */
export function el(name, properties = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (value === undefined || value === null || value === false) continue;
    if (key.startsWith("on") && typeof value === "function") {
      element.addEventListener(key.slice(2), /** @type {EventListener} */ (value));
    } else if (key !== "class" && key !== "list" && key !== "form" && key in element) {
      Reflect.set(element, key, value);
    } else {
      element.setAttribute(key, value === true ? "" : String(value));
    }
  }
  element.append(...nodes(children));
  return element;
}

/**
 * @param {(Child | Child[])[]} children
 * @returns {(Node | string)[]}
 */
function nodes(children) {
  return children.flat().flatMap((child) => {
    if (child === undefined || child === null || child === false) return [];
    return [child instanceof Node ? child : String(child)];
  });
}

/**
 * An element of a drawing.
 * @param {string} name @param {{ [attribute: string]: string | number }} attributes @param {...SVGElement} children
 * @returns {SVGElement}
 */
export function shape(name, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
  element.append(...children);
  return element;
}

/**
 * Replaces the content of `element`.
 * @param {Element} element
 * @param {...(Child | Child[])} children
 */
export function fill(element, ...children) {
  element.replaceChildren(...nodes(children));
}

/**
 * An external name, with its own text direction, so that marks in it do not affect the text around it.
 * @param {string} name
 */
export function named(name) {
  return el("bdi", { class: "name" }, name);
}

/** A patch of a colour. @param {string} colour */
export function swatch(colour) {
  return el("span", { class: "swatch", style: `background: var(--${colour})`, "aria-hidden": "true" });
}

/**
 * Runs `action` at most once a frame.
 * @param {() => void} action
 */
export function oncePerFrame(action) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      action();
    });
  };
}

/**
 * A colour of the style sheet: `colour("craft")` is `--craft`.
 * @param {string} name
 */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

/** The colour of the i-th AUV, from 0, on maps, charts and thumbnails. @param {number} i */
export function auvColour(i) {
  return `auv-${(Math.max(i, 0) % 6) + 1}`;
}

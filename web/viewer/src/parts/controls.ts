import { el } from "./dom.js";

/** What panels are made of: switches, sliders, choices. Each gives its element, and a way to show another value. */
export interface Control<Value> {
  element: HTMLElement;
  show(value: Value): void;
}

export function switchControl(label: string, value: boolean, change: (on: boolean) => void, hint = ""): Control<boolean> {
  const input = el("input", { type: "checkbox", role: "switch", on: { change: () => change(input.checked) } });
  input.checked = value;
  const element = el("label", { class: "row switch" }, el("span", {}, label, hint !== "" && el("small", {}, hint)), input);
  return { element, show: (on) => (input.checked = on) };
}

export interface SliderOptions {
  label: string;
  min: number;
  max: number;
  step?: number;
  value: number;
  /** Equal ways are equal factors. */
  isLogarithmic?: boolean;
  format(value: number): string;
  change(value: number): void;
}

export function sliderControl(options: SliderOptions): Control<number> {
  const { label, min, max, isLogarithmic, format, change } = options;
  const toShare = (value: number): number => (isLogarithmic ? Math.log(value / min) / Math.log(max / min) : (value - min) / (max - min));
  const fromShare = (share: number): number => {
    const value = isLogarithmic ? min * (max / min) ** share : min + (max - min) * share;
    return options.step ? Math.round(value / options.step) * options.step : value;
  };
  const steps = 200;
  const output = el("output", { class: "number" });
  const input = el("input", {
    type: "range",
    min: 0,
    max: steps,
    step: isLogarithmic || !options.step ? 1 : (options.step / (max - min)) * steps,
    "aria-label": label,
  });
  const say = (value: number): void => {
    output.textContent = format(value);
    input.setAttribute("aria-valuetext", format(value));
    input.style.setProperty("--share", String(Math.min(Math.max(toShare(value), 0), 1)));
  };
  input.addEventListener("input", () => {
    const value = fromShare(Number(input.value) / steps);
    say(value);
    change(value);
  });
  const show = (value: number): void => {
    input.value = String(Math.min(Math.max(toShare(value), 0), 1) * steps);
    say(value);
  };
  show(options.value);
  return { element: el("div", { class: "slider" }, el("div", { class: "row" }, el("span", {}, label), output), input), show };
}

let choices = 0;

/** One of a few. */
export function choiceControl<Value extends string>(
  label: string,
  values: readonly { value: Value; label: string; hint?: string }[],
  value: Value,
  change: (value: Value) => void,
  columns = values.length,
): Control<Value> {
  const name = `choice-${++choices}`;
  const inputs = new Map<Value, HTMLInputElement>();
  const options = values.map((each) => {
    const input = el("input", { type: "radio", name, value: each.value, on: { change: () => change(each.value) } });
    input.checked = each.value === value;
    inputs.set(each.value, input);
    return el("label", { class: "choice", title: each.hint }, input, el("span", {}, each.label));
  });
  const element = el("fieldset", { class: "choices", style: `--columns: ${columns}` }, el("legend", {}, label), ...options);
  return {
    element,
    show: (chosen) => {
      const input = inputs.get(chosen);
      if (input) input.checked = true;
    },
  };
}

/** A line of a table of results: what, and how much. */
export function resultRow(label: string, value: string, hint = ""): HTMLElement {
  return el("div", { class: "row result", title: hint || undefined }, el("span", {}, label), el("strong", { class: "number" }, value));
}

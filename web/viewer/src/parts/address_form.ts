import { el } from "./dom.js";

/** Asks for the address of a dataset, and opens it in place of this page. */
export function makeAddressForm(): HTMLFormElement {
  return el(
    "form",
    { class: "open-address", on: { submit: openAddress } },
    el(
      "label",
      {},
      "Address of a dataset",
      el("input", { name: "dataset", type: "text", inputmode: "url", placeholder: "https://example.org/alps.terrane/", required: true }),
    ),
    el("button", { class: "primary", type: "submit" }, "Open"),
  );
}

function openAddress(event: SubmitEvent): void {
  event.preventDefault();
  const address = String(new FormData(event.target as HTMLFormElement).get("dataset") ?? "").trim();
  if (address !== "") location.href = `?dataset=${encodeURIComponent(address)}`;
}

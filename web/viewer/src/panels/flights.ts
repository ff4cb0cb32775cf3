import type { Panel } from "../app.js";
import { download, el, fill } from "../parts/dom.js";
import { formatDuration } from "../parts/format.js";
import { icon } from "../parts/icons.js";

export const flightsPanel: Panel = {
  id: "flights",
  title: "Flights",
  icon: "flights",
  key: "c",
  purpose: "Record the camera’s way, fly it again, keep it as a file",
  open(app) {
    const { flights } = app;
    const time = el("span", { class: "number" });
    const record = el("button", { class: "primary", type: "button", id: "flight-record", on: { click: () => flights.toggleRecording() } });
    const replay = el("button", {
      class: "secondary",
      type: "button",
      id: "flight-replay",
      on: { click: () => (flights.state === "flying" ? flights.stopFlying() : flights.replay()) },
    });
    const save = el(
      "button",
      {
        class: "secondary",
        type: "button",
        id: "flight-save",
        on: {
          click: () => {
            if (flights.flight) download(`${app.dataset.name}-flight.json`, new Blob([flights.flight.json], { type: "application/json" }));
          },
        },
      },
      icon("download"),
      "Save",
    );
    const about = el("p", { class: "faint flight-about" });
    const show = (): void => {
      const { state, flight } = flights;
      fill(
        record,
        icon(state === "recording" ? "stop" : "record"),
        state === "recording" ? "Stop recording" : "Record",
        state === "recording" && time,
      );
      record.classList.toggle("is-recording", state === "recording");
      fill(replay, icon(state === "flying" ? "stop" : "play"), state === "flying" ? "Stop" : "Fly it");
      replay.disabled = flight === null || state === "recording";
      save.disabled = flight === null || state === "recording";
      about.textContent =
        state === "recording"
          ? "Move the camera: where it goes is written down."
          : flight
            ? `${flight.name}, ${formatDuration(flight.seconds)}${state === "flying" ? ", being flown: any move of yours ends it" : ""}`
            : "Nothing recorded yet. A flight’s file can also be dropped on the page.";
    };
    const stop = flights.onChange(show);
    const timer = setInterval(() => (time.textContent = formatDuration(flights.recordedSeconds)), 250);
    show();
    return {
      body: el(
        "div",
        {},
        about,
        el(
          "div",
          { class: "buttons" },
          record,
          replay,
          save,
          el("button", { class: "secondary", type: "button", on: { click: () => app.openFiles() } }, icon("open"), "Open"),
        ),
      ),
      close: () => {
        clearInterval(timer);
        stop();
      },
    };
  },
};

/** Builds the page from the data in the document. */
import "./app.css";
import { PageApp } from "./app";
import { readPageData } from "./data";
import { Live } from "./live";
import type { Panel } from "./panel";
import { panels } from "./panels";
import { testHooks } from "./plots/hooks";
import { installMarker } from "./plots/marker";
import { Change, type State } from "./state";
import { element } from "./ui/dom";
import { Layout, frame } from "./ui/layout";
import { useFiles } from "./ui/files";

function start(host: HTMLElement): void {
  const data = readPageData();
  const parts = frame(host);
  const app = new PageApp(data, parts.canvas, parts.overlay);
  const layout = new Layout(app, parts);
  app.onRefresh = (what) => layout.refresh(what);
  app.store.subscribe((change) => layout.update(change));
  for (const panel of panels) layout.dock.add(panel);
  installMarker(app, layout.dock.panels);
  // Such as an external panel that fails to load. (Browsers also report deferred observers here, without an error.)
  addEventListener("error", ({ error, message }) => {
    if (error) app.say(message, "error");
  });
  layout.update(new Change(new Set([""])));
  if (data.socket) {
    layout.live = new Live(app, data.socket);
    layout.live.onStatus = () => layout.showStatus();
  }
  // The interface for external panels, tests and the console.
  Object.assign(window, {
    gonio: {
      app,
      data,
      ready: app.ready,
      addPanel: (panel: Panel) => layout.dock.add(panel),
      live: layout.live,
      get state() {
        return app.state;
      },
      get frames() {
        return app.frames;
      },
      readPixels: () => app.picture(),
      converge: (samples?: number) => app.converge(samples),
      setState: (write: (state: State) => void) => app.store.update("", write),
      useFiles: (...files: File[]) => useFiles(app, files),
      ...testHooks(app),
    },
  });
}

const host = document.getElementById("app") ?? document.body.appendChild(element("div"));
try {
  start(host);
} catch (error) {
  host.replaceChildren(element("p", { class: "fatal" }, error instanceof Error ? error.message : String(error)));
  throw error;
}

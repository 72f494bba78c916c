// The picture as it grows, and one cell for each chunk of it.
import { get } from "./api.js";
import { atMostEvery, byId, say } from "./dom.js";
import { clock, ms } from "./format.js";
import { satellite } from "./model.js";

let shown = null; // "id:held" of the picture on the screen
let map = "";

export const refreshPicture = atMostEvery(1500, async () => {
  const progress = satellite()?.image;
  if (!progress) return;
  const [image, chunks] = await Promise.all([
    get(`images/${progress.image}`),
    get(`images/${progress.image}/chunks`),
  ]);
  map = chunks.map;
  paintGrid();
  describe(image, chunks);
  const version = `${image.id}:${chunks.held}:${chunks.conflicts}`;
  if (!shown?.startsWith(`${image.id}:`)) hide(map[0] === "." ? "Chunk 0, the head of the picture, is still missing." : "The picture is on its way: its first chunks are still missing.");
  if (chunks.held > 0 && version !== shown) load(image, version);
});

function describe(image, chunks) {
  const percent = Math.floor((100 * chunks.held) / Math.max(1, chunks.chunks));
  say(byId("picture-count"), `${chunks.held} / ${chunks.chunks} chunks, ${percent} %`);
  byId("picture-bar").style.width = `${(100 * chunks.held) / Math.max(1, chunks.chunks)}%`;
  const parts = [`image ${image.id}`, `${image.width_px} × ${image.height_px}`, `${image.size_bytes} bytes`];
  if (chunks.conflicts > 0) parts.push(`${chunks.conflicts} in conflict`);
  if (image.complete) parts.push(`complete ${clock(ms(image.completed_at))} UTC`, `sha256 ${image.sha256?.slice(0, 12) ?? "?"}…`);
  say(byId("picture-line"), parts.join(" · "));
}

/** Decoded beside the one on the screen and exchanged when it is ready: no flicker while it grows. */
async function load(image, version) {
  const next = new Image();
  next.src = `/api/v1/images/${image.id}/file?v=${encodeURIComponent(version)}`;
  try {
    await next.decode();
  } catch {
    return; // What was there stays.
  }
  const img = byId("image");
  img.src = next.src;
  img.alt = `Image ${image.id}, ${image.held} of ${image.chunks} chunks`;
  img.hidden = false;
  byId("image-none").hidden = true;
  shown = version;
}

function hide(why) {
  shown = null;
  byId("image").hidden = true;
  byId("image-none").hidden = false;
  say(byId("image-none"), why);
}

const COLOURS = { "#": "--text", "!": "--distress", ".": "--faint" };

export function paintGrid() {
  const canvas = byId("chunks");
  const width = canvas.clientWidth;
  if (map.length === 0 || width === 0) {
    canvas.style.height = "0";
    return;
  }
  // The largest cell with which the grid stays below 96 px; never smaller than 2 px.
  let cell = 14;
  while (cell > 2 && Math.ceil(map.length / Math.floor(width / cell)) * cell > 96) cell -= 1;
  const columns = Math.floor(width / cell);
  const height = Math.ceil(map.length / columns) * cell;
  const scale = window.devicePixelRatio || 1;
  canvas.style.height = `${height}px`;
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  const pen = canvas.getContext("2d");
  pen.scale(scale, scale);
  const style = getComputedStyle(document.documentElement);
  const gap = cell > 4 ? 1 : 0;
  for (let i = 0; i < map.length; i += 1) {
    const x = (i % columns) * cell;
    const y = Math.floor(i / columns) * cell;
    pen.fillStyle = pen.strokeStyle = style.getPropertyValue(COLOURS[map[i]] ?? "--faint");
    // Held is filled, missing is a frame; where cells are too small for that, missing is left dark.
    if (map[i] !== ".") pen.fillRect(x, y, cell - gap, cell - gap);
    else if (cell > 4) pen.strokeRect(x + 0.5, y + 0.5, cell - gap - 1, cell - gap - 1);
    // A conflict differs in shape as well as in colour.
    if (map[i] === "!" && cell > 4) pen.clearRect(x + cell / 3, y + cell / 3, cell / 3, cell / 3);
  }
  const count = (letter) => map.split(letter).length - 1;
  const label = `${map.length} chunks: ${count("#")} held, ${count(".")} missing, ${count("!")} in conflict`;
  canvas.setAttribute("aria-label", label);
  canvas.title = label;
}

export function resetPicture() {
  map = "";
  hide("No image declared yet.");
  say(byId("picture-count"), "");
  say(byId("picture-line"), "");
  byId("picture-bar").style.width = "0";
  paintGrid();
}

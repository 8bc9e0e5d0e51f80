// A file, a folder or a zip that is dropped on the page while the button that uploads a robot is on it. A
// folder becomes a zip with its descriptions and meshes.
(() => {
  if (window.__himpcLabDrop) return;
  window.__himpcLabDrop = true;
  const kept = /\.(urdf|xml|stl|dae|obj|mtl|ply|glb|gltf|bin|off|msh)$/i, most = 5000;
  const button = () => document.querySelector("input[type=file][accept*='.urdf'][accept*='.zip']");
  const takes = (event) => button() && event.dataTransfer?.types.includes("Files");

  const files = async (entry, place) => {
    if (entry.isFile) {
      if (!kept.test(entry.name)) return [];
      return [[place + entry.name, await new Promise((done, no) => entry.file(done, no))]];
    }
    const reader = entry.createReader(), found = [];
    for (;;) {
      const some = await new Promise((done, no) => reader.readEntries(done, no));
      if (some.length === 0 || found.length > most) return found;
      for (const each of some) found.push(...await files(each, `${place}${entry.name}/`));
    }
  };

  const table = Array.from({ length: 256 }, (_, byte) => {
    for (let bit = 0; bit < 8; bit++) byte = byte & 1 ? (byte >>> 1) ^ 0xedb88320 : byte >>> 1;
    return byte >>> 0;
  });
  const checksum = (bytes) => {
    let value = 0xffffffff;
    for (const byte of bytes) value = table[(value ^ byte) & 255] ^ (value >>> 8);
    return (value ^ 0xffffffff) >>> 0;
  };
  const numbers = (...pairs) => {
    const view = new DataView(new ArrayBuffer(pairs.reduce((sum, [size]) => sum + size, 0)));
    let at = 0;
    for (const [size, value] of pairs) {
      size === 2 ? view.setUint16(at, value, true) : view.setUint32(at, value, true);
      at += size;
    }
    return new Uint8Array(view.buffer);
  };
  // The bit 2048 says that names are UTF-8; the method 8 is deflate.
  const zipped = async (found, name) => {
    const parts = [], ends = [];
    let at = 0, size = 0;
    for (const [path, file] of found) {
      const bytes = new Uint8Array(await file.arrayBuffer()), words = new TextEncoder().encode(path);
      const stream = new Blob([bytes]).stream().pipeThrough(new CompressionStream("deflate-raw"));
      const small = new Uint8Array(await new Response(stream).arrayBuffer());
      const told = [[2, 20], [2, 2048], [2, 8], [4, 0], [4, checksum(bytes)], [4, small.length],
        [4, bytes.length], [2, words.length], [2, 0]];
      const head = numbers([4, 0x04034b50], ...told);
      const end = numbers([4, 0x02014b50], [2, 20], ...told, [2, 0], [2, 0], [2, 0], [4, 0], [4, at]);
      parts.push(head, words, small);
      ends.push(end, words);
      at += head.length + words.length + small.length;
      size += end.length + words.length;
    }
    const count = found.length;
    const close = numbers([4, 0x06054b50], [2, 0], [2, 0], [2, count], [2, count], [4, size], [4, at], [2, 0]);
    return new File([...parts, ...ends, close], `${name}.zip`, { type: "application/zip" });
  };

  document.addEventListener("dragover", (event) => { if (takes(event)) event.preventDefault(); });
  document.addEventListener("drop", async (event) => {
    if (!takes(event)) return;
    event.preventDefault();
    const entries = [...event.dataTransfer.items].map((each) => each.webkitGetAsEntry()).filter(Boolean);
    const [first] = event.dataTransfer.files, to = button();
    const alone = entries.length < 2 && !entries[0]?.isDirectory;
    const found = alone ? [] : (await Promise.all(entries.map((each) => files(each, "")))).flat();
    const box = new DataTransfer();
    box.items.add(alone ? first : await zipped(found.slice(0, most), entries[0].name));
    to.files = box.files;
    to.dispatchEvent(new Event("change", { bubbles: true }));
  });
})();

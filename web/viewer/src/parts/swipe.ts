/** As in style.css: below this width panels are sheets at the bottom. */
const kSheets = "(max-width: 640px)";
/** So far down, or a tap on the handle, closes a sheet. */
const kFarPixels = 48;
const kSlopPixels = 8;
/** The handle is drawn in the middle of the head; a tap may miss it by so much. */
const kHandlePixels = 48;

/** The head of a sheet follows the finger down; far enough, or tapped on its handle, the sheet closes. */
export function closeBySwipe(head: HTMLElement, sheet: HTMLElement, close: () => void): void {
  let begun: { id: number; x: number; y: number } | null = null;
  const end = (): void => {
    begun = null;
    sheet.style.translate = "";
  };
  head.addEventListener("pointerdown", (event) => {
    const isButton = event.target instanceof Element && event.target.closest("button") !== null;
    if (isButton || !event.isPrimary || !matchMedia(kSheets).matches) return;
    begun = { id: event.pointerId, x: event.clientX, y: event.clientY };
    head.setPointerCapture(event.pointerId);
  });
  head.addEventListener("pointermove", (event) => {
    if (begun?.id !== event.pointerId) return;
    sheet.style.translate = `0 ${Math.max(event.clientY - begun.y, 0)}px`;
  });
  head.addEventListener("pointerup", (event) => {
    if (begun?.id !== event.pointerId) return;
    const down = event.clientY - begun.y;
    const box = head.getBoundingClientRect();
    const isOnHandle = Math.abs(begun.x - (box.left + box.width / 2)) < kHandlePixels;
    const isTap = Math.hypot(event.clientX - begun.x, down) < kSlopPixels;
    end();
    if (down > kFarPixels || (isTap && isOnHandle)) close();
  });
  head.addEventListener("pointercancel", end);
}

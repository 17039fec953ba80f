/// Files that the page makes itself.
export function save(name: string, content: Blob): void {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export function save_text(name: string, type: string, text: string): void {
  save(name, new Blob([text], { type }));
}

const kStyles = [
  "fill",
  "fill-opacity",
  "stroke",
  "stroke-width",
  "stroke-dasharray",
  "stroke-linejoin",
  "paint-order",
  "opacity",
  "font-size",
  "font-weight",
] as const;

/// A drawing of the page as a file of its own: with the colours it has here.
export function standalone_svg(drawing: SVGSVGElement): string {
  const copy = drawing.cloneNode(true) as SVGSVGElement;
  const copies = [copy, ...copy.querySelectorAll<SVGElement>("*")];
  [drawing, ...drawing.querySelectorAll<SVGElement>("*")].forEach((element, i) => {
    const style = getComputedStyle(element);
    for (const name of kStyles) {
      const value = style.getPropertyValue(name);
      if (value !== "") copies[i]?.setAttribute(name, value);
    }
    copies[i]?.removeAttribute("class");
  });
  copy.setAttribute("font-family", "sans-serif");
  copy.setAttribute("xmlns", "http://www.w3.org/2000/svg");
  return new XMLSerializer().serializeToString(copy).replace(/<!--.*?-->/gs, "");
}

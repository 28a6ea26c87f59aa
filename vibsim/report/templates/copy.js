// Buttons copy the text that a block of data holds; without scripts there are no buttons.
async function copyText(button, text) {
  const was = button.textContent;
  await navigator.clipboard.writeText(text);
  button.textContent = "Copied";
  setTimeout(() => (button.textContent = was), 2000);
}
for (const button of document.querySelectorAll("button.copy[data-of]")) {
  button.hidden = false;
  button.addEventListener("click", () => copyText(button, JSON.parse(document.getElementById(button.dataset.of).textContent)));
}

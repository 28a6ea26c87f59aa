// Buttons copy the text that a block of data holds; without scripts there are no buttons.
for (const button of document.querySelectorAll("button.copy")) {
  button.hidden = false;
  button.addEventListener("click", async () => {
    const text = JSON.parse(document.getElementById(button.dataset.of).textContent);
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  });
}

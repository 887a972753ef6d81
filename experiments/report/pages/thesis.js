// Claims of one verdict, of all chapters.

const verdicts = document.getElementById("verdicts");

function filterClaims() {
  const claims = [...document.querySelectorAll("tr[data-verdict]")];
  for (const row of claims) {
    row.hidden = verdicts.value !== "" && row.dataset.verdict !== verdicts.value;
  }
  const kept = claims.filter((row) => !row.hidden).length;
  document.getElementById("shown").textContent =
    kept === claims.length ? "" : `${kept} of ${claims.length} claims`;
}

verdicts.addEventListener("change", filterClaims);

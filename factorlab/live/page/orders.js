// What a page asks the program to do; it answers with its state, and with a sentence where it could not be done.

export async function order(wish) {
  const answer = await fetch("/command", {
    method: "POST",
    headers: { "Content-Type": "application/json" },
    body: JSON.stringify(wish),
  });
  return answer.json();
}

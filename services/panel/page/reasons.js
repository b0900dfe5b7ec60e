// Why something is not done, in the reader's language. Robot and station say it in English sentences,
// in which a word in braces here stands for whatever they put there. A test holds the table to the
// sentences that they know; what is not in it is shown as it was said. A third sentence is the page's English,
// where the other names a command of a terminal: here a button stands beside it.

import { pairs } from "./sentences.js";
import { current, say } from "./words.js";

const TABLE = [
  // The panel and the station.
  ["this page may look and stop; a driver's address is needed for more", "den här sidan får titta och stoppa; för mer behövs en förares adress"],
  ["take the wheel first", "ta ratten först"],
  ["came {late} ms late; give it anew", "kom {late} ms för sent; gör om det"],
  ["it is asked for anew", "den efterfrågas på nytt"],
  ["{who} has asked for the wheel before", "{who} har redan bett om ratten"],
  ["{who} keeps the wheel", "{who} behåller ratten"],
  ["{who} does not answer; ask again", "{who} svarar inte; fråga igen"],
  ["{who} drives the robot; ask him", "{who} kör roboten; fråga först"],
  ["{who} drives the robot; wait until he has left, or stop it", "{who} kör roboten; vänta tills ratten är ledig, eller stoppa den"],
  ["the robot does not answer", "roboten svarar inte"],
  ["{file} is not saved: {error}", "{file} är inte sparad: {error}"],
  ["{file} is not saved: it could not be read again", "{file} är inte sparad: den skulle inte kunna läsas igen"],
  ["saved in {file}", "sparat i {file}"],
  ["taken, and lost when the station ends", "mottaget, och borta när stationen avslutas"],
  ["{robot} uses it", "{robot} använder det"],
  ["{robot} is told where the goods are", "{robot} får veta var varorna står"],
  ["{robot} is driven and is told where the goods are when it connects anew", "{robot} körs och får veta var varorna står när den ansluter på nytt"],
  ["{robot} still uses the floor of before, until it is put on the delivery node and `lager up` is started again", "{robot} använder fortfarande det förra golvet, tills den står på leveransnoden och `lager up` startas om"],
  ["{robot} is simulated and still drives in the warehouse of before, until `lager up` is started again", "{robot} är simulerad och kör kvar i det förra lagret, tills `lager up` startas om"],
  ["product {id} is ordered already", "vara {id} är redan beställd"],
  ["product {id} is not in its place, as robot {robot} has seen; put it back and say `lager map back {id2}`", "vara {id} är inte på sin plats, det har roboten {robot} sett; ställ tillbaka den och säg `lager map back {id2}`"],
  ["the page does not answer", "sidan svarar inte"],
  ["the last action on this connection had the number {last}, so number {number} may have been carried out before; give it anew with a greater number", "den senaste åtgärden på den här förbindelsen hade nummer {last}, så nummer {number} kan redan vara utförd; ge den på nytt med ett högre nummer"],
  ["a page says lines of text", "en sida säger rader av text"],
  ["this page speaks another language; load it anew", "den här sidan talar ett annat språk; ladda om den"],
  [
    "this page has no token; open the address that `lager up` or `lager station` has printed",
    "den här sidan har ingen nyckel; öppna adressen som `lager up` eller `lager station` har skrivit ut",
  ],
  ["more is said than a person can", "mer sägs än vad en människa hinner"],
  ["the robot is moved by its driver alone; take the wheel first", "bara föraren rör roboten; ta ratten först"],
  ["the robot speaks only the document's language, or is away; it takes no actions", "roboten talar bara dokumentets språk, eller är borta; den kan inte styras härifrån"],
  ["{count} actions are unanswered already; wait for the robot, or stop it", "{count} åtgärder väntar redan på svar; vänta på roboten, eller stoppa den"],
  ["the robot takes no commands now; it does when it is switched to manual or stands at goods", "roboten tar inga kommandon nu; det gör den när den körs för hand eller står vid varor"],
  ["{count} commands wait already; wait until the robot has taken some, or stop it", "{count} kommandon väntar redan; vänta tills roboten har tagit några, eller stoppa den"],
  ["there is no robot {name} here; it connects by itself once it is up", "här finns ingen robot {name}; den ansluter själv när den är igång"],
  // A warehouse that cannot be.
  ["this is no warehouse: {why}", "detta är inget lager: {why}"],
  ["a warehouse of {x} x {y} squares has none; each must be from 1 to 255", "ett lager med {x} x {y} rutor har inga; båda talen ska vara 1 till 255"],
  ["({corner}) is no corner of the warehouse; the delivery is at ({first}), ({second}), ({third}) or ({fourth})", "({corner}) är inget hörn av lagret; leveransen är vid ({first}), ({second}), ({third}) eller ({fourth})"],
  ["side_length_cm is 0; it must be from 1 to 65535 cm", "rutans sida är 0; den ska vara 1 till 65535 cm"],
  ["product {id} has a negative number; numbers start at 0", "vara {id} har ett negativt nummer; numren börjar på 0"],
  ["product {id} is reached from {side}; write left, up, right or down", "vara {id} nås från {side}; skriv left, up, right eller down"],
  ["product {id} stands in the square [{square}], but the last one is [{last}]", "vara {id} står i rutan [{square}], men den sista är [{last}]"],
  ["product {id} stands in the square ({square}), which a warehouse of {x} x {y} squares does not have", "vara {id} står i rutan ({square}), som ett lager med {x} x {y} rutor inte har"],
  ["product {id} is listed twice; every product needs a number of its own", "vara {id} finns två gånger; varje vara behöver ett eget nummer"],
  ["a product is named {name}, which would be taken for its number; use a letter", "en vara heter {name}, som skulle tas för dess nummer; använd en bokstav"],
  ["a product is named {name}: {label} cannot stand for a product; it must have a character and neither comma, semicolon, line break nor a blank at its ends", "en vara heter {name}: {label} kan inte stå för en vara; namnet ska ha ett tecken och varken komma, semikolon, radbrytning eller blanktecken i ändarna"],
  ["two products are named {name}; every name needs to be another one", "två varor heter {name}; varje namn måste vara ett annat"],
  ["the warehouse has {count} products, which do not fit in one line of the robot's language; list fewer", "lagret har {count} varor, som inte ryms på en rad i robotens språk; ange färre"],
  ["{count} products are listed; a robot takes {most} at most", "{count} varor är angivna; en robot klarar högst {most}"],
  // The robot, of what it is asked.
  ["the robot has been stopped", "roboten har stoppats"],
  ["the link is lost", "länken är bruten"],
  ["the robot was held up, so what it has not read may be old", "roboten hölls upp, så det som den inte har läst kan vara gammalt"],
  ["the external computer has fallen silent", "den externa datorn har tystnat"],
  ["the time of the last drive is over and nobody has renewed it", "tiden för den senaste körningen är ute och ingen har förnyat den"],
  ["the mode has been changed", "läget har bytts"],
  ["another command has taken its place", "ett annat kommando har tagit dess plats"],
  ["its lines cannot be read", "dess rader kan inte läsas"],
  ["say `lager 1 <name>` before any other line of the extension", "säg `lager 1 <namn>` före utökningens andra rader"],
  ["there is no product {id}", "det finns ingen vara {id}"],
  ["the robot is autonomous and stands at goods: only its arm is moved", "roboten är autonom och står vid varor: bara armen rörs"],
  ["a stop has come with it; give it anew", "ett stopp kom samtidigt; gör om det"],
  ["{count} actions are under way; wait for their end", "{count} åtgärder pågår; vänta tills de är klara"],
  ["orders are numbered from 1 on: 0 means none", "order numreras från 1: 0 betyder ingen"],
  ["there is an order {id} already", "det finns redan en order {id}"],
  ["order {id} is under way and waits no more", "order {id} pågår och väntar inte längre"],
  ["order {id} is under way and its goods are in the claw: they are delivered first", "order {id} pågår och varan är i klon: den levereras först"],
  ["no order {id} waits; `lager queue` shows those that do", "ingen order {id} väntar", "no order {id} waits"],
  ["the robot does not wait at goods", "roboten väntar inte vid varor"],
  ["the robot does not stand at goods, so nothing was picked up", "roboten står inte vid varor, så inget har plockats upp"],
  ["the robot is moving; drive it by hand or stop it first", "roboten rör sig; kör den för hand eller stoppa den först"],
  ["logic does not take the order", "logiken tar inte emot ordern"],
  ["logic does not react", "logiken reagerar inte"],
  ["logic does not react to pickup_done", "logiken reagerar inte på pickup_done"],
  ["logic does not react: the goods may be in the claw by now", "logiken reagerar inte: varan kan vara i klon nu"],
  ["the sensor board does not say how the calibration went; try again", "sensorkortet säger inte hur kalibreringen gick; försök igen"],
  ["only {count} of the 11 line sensors have seen both floor and tape, and the others keep their thresholds; calibrate again and move the robot to and fro across the tape meanwhile", "bara {count} av de 11 linjesensorerna har sett både golv och tejp, och de andra behåller sina trösklar; kalibrera igen och för roboten fram och tillbaka över tejpen under tiden"],
  ["the sensor board fell silent or restarted before the calibration had ended; `lager doctor` looks for the cause", "sensorkortet tystnade eller startade om innan kalibreringen var klar; `lager doctor` letar efter orsaken"],
  ["a newer stop is set; look at the robot and release that one", "ett nyare stopp är satt; titta på roboten och häv det"],
  ["a newer stop is set, {stop}; look at the robot and release that one", "ett nyare stopp är satt ({stop}); titta på roboten och häv det"],
  ["the bridge answers what nobody here understands", "bryggan svarar något som ingen här förstår"],
  ["the simulated world does not answer in time; is it very slow?", "den simulerade världen svarar inte i tid; är den mycket långsam?"],
  ["too much is asked for at a time; try again", "för mycket begärs på en gång; försök igen"],
  ["{who} is not running, so nobody answers `{what}`; start it and try again", "{who} är inte igång, så ingen svarar på `{what}`; starta den och försök igen"],
  ["{who} did not answer `{what}` in time; it may be restarting, try again", "{who} svarade inte på `{what}` i tid; den kanske startar om, försök igen"],
  ["{command} is not possible now: {why}", "{command} går inte nu: {why}"],
  // The steering board, of a command.
  ["{command} is refused: {why}", "{command} nekas: {why}"],
  ["{command} is over: the robot was held up for {ms} ms; give it anew", "{command} är över: roboten hölls upp i {ms} ms; gör om det"],
  ["{command} is over: the steering board has not reported for {ms} ms; give it anew", "{command} är över: styrkortet har inte rapporterat på {ms} ms; gör om det"],
  ["{command} does not come to its end", "{command} kommer inte till sitt slut"],
  ["{command} has not ended", "{command} är inte klart"],
  ["{command} is done", "{command} är klart"],
  ["{command} was cut short: a board was reset, another order took its place, or it was not renewed in time", "{command} avbröts: ett kort startade om, en annan order tog dess plats, eller det förnyades inte i tid"],
  ["{command} is refused by the steering board: the arm moves only while the robot stands, and no joint beyond its limits in [arm]", "{command} nekas av styrkortet: armen rör sig bara när roboten står, och ingen led utanför sina gränser i [arm]"],
  ["{command} was given up: the sensor board's words do not reach the steering board; look at the cable between the two boards", "{command} gavs upp: sensorkortets ord når inte styrkortet; se till kabeln mellan korten"],
  ["{command} was given up: the steering board has seen no tape for too long", "{command} gavs upp: styrkortet har inte sett tejp på för länge"],
  // The bridge.
  ["nothing is refused", "inget nekas"],
  ["origin or command code have no meaning", "ursprung eller kommandokod har ingen betydelse"],
  ["only logic may give this command", "bara logiken får ge detta kommando"],
  ["the arm is locked while the wheels move", "armen är låst medan hjulen rör sig"],
  ["its number is in use for another command", "numret används för ett annat kommando"],
  ["somebody else steers in this mode; `lager mode` changes who steers", "någon annan styr i detta läge", "somebody else steers in this mode"],
  ["the robot is stopped; `lager resume` releases the stop", "roboten är stoppad", "the robot is stopped"],
  ["the bridge is shutting down", "bryggan stängs av"],
  ["no steering board is connected; `lager doctor` looks for the cause", "inget styrkort är anslutet; `lager doctor` letar efter orsaken"],
  ["the steering board does not report; look at its cable and its power", "styrkortet rapporterar inte; se till dess kabel och ström"],
  ["the steering board is an original one, whose commands have no age limit; `[serial] original_boards = true` accepts that", "styrkortet är ett originalkort, vars kommandon inte har någon åldersgräns; `[serial] original_boards = true` godtar det"],
  ["it was held up for too long on its way; give it anew", "det hölls upp för länge på vägen; gör om det"],
  ["the steering board has not taken [arm] of the configuration; flash the image of this program's version", "styrkortet har inte tagit [arm] ur konfigurationen; flasha avbilden för den här programversionen"],
  ["it is done", "det är klart"],
  ["it is refused: the value is out of range, or the board is an original one without settings", "det nekas: värdet är utanför området, eller kortet är ett originalkort utan inställningar"],
  ["the board that would have to do it is not connected; `lager topic echo link/health` shows the links", "kortet som skulle göra det är inte anslutet; `lager topic echo link/health` visar länkarna"],
  ["the robot is on its way by itself; stop it or drive it by hand before that", "roboten är på väg på egen hand; stoppa den eller kör den för hand innan dess"],
  ["it was found when its time was over, since somebody was held up; nothing was changed, try again", "det hittades när dess tid var ute, eftersom någon hölls upp; inget ändrades, försök igen"],
  // The simulated world.
  ["the warehouse has no such crossing or way", "lagret har ingen sådan korsning eller väg"],
  ["the robot is there; wait until it has gone on, or `lager stop` it elsewhere", "roboten är där; vänta tills den har kört vidare, eller stoppa den någon annanstans", "the robot is there; wait until it has gone on, or stop it elsewhere"],
  ["nothing stands there; `lager obstacle` lists what stands", "där står inget", "nothing stands there"],
  ["no more things fit into the warehouse; `lager obstacle take` one first", "fler saker får inte plats i lagret; ta bort en först", "no more things fit into the warehouse; take one away first"],
  ["the ways are so short that the robot could not turn beside a thing", "vägarna är så korta att roboten inte skulle kunna svänga bredvid en sak"],
  // Commands, by their names.
  ["forward", "framåt"], ["follow-forward", "följ linje"], ["backward", "bakåt"], ["follow-backward", "följ linje bakåt"],
  ["left", "vänster"], ["right", "höger"], ["left-diag", "45° vänster"], ["right-diag", "45° höger"], ["stop", "stå"],
  ["clockwise", "klo medurs"], ["counter-clockwise", "klo moturs"], ["out", "ut"], ["up", "upp"], ["down", "ner"],
  ["squeeze", "kläm"], ["release", "släpp"],
];

const words = ([english]) => english.split("{").length;
/** Each English sentence as an expression with a group for each word in braces (one that stands there again is the same), and what the page says in each language. */
const PATTERNS = [...pairs("failure_"), ...TABLE]
  // Those that say most themselves come first.
  .sort((one, other) => words(one) - words(other))
  .map(([said, sv, en = said]) => {
    const fixed = said.replace(/[.*+?^$()|[\]\\]/g, "\\$&");
    const seen = new Set();
    const group = (_, word) => (seen.has(word) ? `\\k<${word}>` : seen.add(word) && `(?<${word}>.+)`);
    return [new RegExp(`^${fixed.replace(/\{(\w+)\}/g, group)}$`), { sv, en }];
  });

/** Why an answer is no: `refused` as the link has it, "lost" where there is no link. */
export function reason(refused) {
  if (refused === "lost") return say("lost");
  for (const [pattern, told] of PATTERNS) {
    const found = pattern.exec(refused);
    // What was put in may be a reason itself.
    if (found) return told[current()].replace(/\{(\w+)\}/g, (_, word) => reason(found.groups[word]));
  }
  return refused;
}

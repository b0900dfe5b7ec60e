/* Two bytes at once, one into the shift register and one into the buffer; then an echo, plus one. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

ISR(USART0_RX_vect) { UDR0 = UDR0 + 1; }

int main(void) {
    UBRR0 = 1;
    /* The transmitter is off after a reset: this goes nowhere. */
    UDR0 = 0x99;
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    sei();
    UDR0 = 0x11;
    UDR0 = 0x22;
    for (;;) sleep_mode();
}

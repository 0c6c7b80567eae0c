"""What pages, figures and the terminal are made of; nothing here knows what is shown."""

"""The picture of UN Regulation 157: which conflicts an attentive driver avoids."""
